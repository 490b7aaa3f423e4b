//! From a measurement to a verdict, on an image so small that only the exact results are meaningful.

use std::{fs, path::Path};

use super::{baseline::Baseline, conditions::Conditions, measure::Measured, *};

/// The CPU backends on a tiny scene.
fn gate(options: &GateOptions) -> Gate<'_> {
    let runners = Runners::open().unwrap();
    let lineup = guarded::Lineup { devices: Vec::new(), ..runners.lineup.clone() };
    let problem = Problem { scene: scenes::made_up(0, 12).unwrap(), labels: 12, k: 18 };
    Gate { options, guarded: guarded::all(&lineup), problem, runners, machine: machine::machine(None) }
}

fn options(baselines: &Path) -> GateOptions {
    GateOptions { quick: true, rounds: 3, baselines: baselines.to_owned(), update: None, proposal: None }
}

/// A measurement as if nothing else had run.
fn measure(gate: &Gate<'_>) -> Measured {
    let conditions = Conditions { others: 0.0, copy_gb_per_s: 20.0 };
    Measured { conditions, ..gate.measure(&Watch::default()).unwrap() }
}

/// The baselines made of one measurement.
fn renewed(gate: &Gate<'_>, measured: &Measured, renewal: Renewal) -> Baselines {
    let mut baselines = Baselines::read(&gate.options.baselines, &machine::machine(None), true).unwrap();
    gate.renew(renewal, &mut baselines, std::slice::from_ref(measured)).unwrap();
    baselines
}

fn judge(gate: &Gate<'_>, measured: &Measured) -> Judgement {
    let baselines = Baselines::read(&gate.options.baselines, &machine::machine(None), false).unwrap();
    Judgement::new(gate, &baselines, measured).unwrap()
}

/// Edits a file as a person might.
fn edit(path: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let mut json = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    change(&mut json);
    fs::write(path, json.to_string()).unwrap();
}

#[test]
fn what_a_baseline_expects_passes_and_what_it_does_not_fails_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path());
    let gate = gate(&options);
    let measured = measure(&gate);
    let first = judge(&gate, &measured);
    assert!(first.failures().is_empty() && page(&first).contains("There is no baseline"), "{}", page(&first));
    assert!(first.is_partial() && first.summary().starts_with("0 of 18 speed-ups were judged"), "{}", first.summary());

    let baselines = renewed(&gate, &measured, Renewal::Everywhere);
    let same = judge(&gate, &measured);
    let text = page(&same);
    assert!(same.failures().is_empty() && !text.contains("There is no baseline"), "{text}");
    assert!(!text.contains("no baseline |") && text.contains("0 changed, 0 without one"), "{text}");

    let [speed_up, energy] = ["rayon on 1 thread: sweep over bp, total", "sweep: energy"];
    edit(baselines.path_here(), |json| json["baseline"]["runs"]["quick"]["speed_ups"][speed_up] = 1e9.into());
    edit(baselines.path_anywhere(), |json| json["baseline"]["runs"]["quick"]["facts"][energy] = "7".into());
    let mut other = judge(&gate, &measured);
    assert!(other.is_any_worse() && page(&other).contains("WORSE"), "{}", page(&other));
    other.repeat(&measured);
    let failures = other.failures();
    assert!(failures.len() == 2 && failures[0].contains(speed_up) && failures[1].contains(energy), "{failures:?}");
    assert!(page(&other).contains("measured again") && page(&other).contains("| sweep: energy |"), "{}", page(&other));
}

#[test]
fn other_devices_and_other_settings_have_no_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let mut options = options(folder.path());
    let (measured, path) = {
        let gate = gate(&options);
        let measured = measure(&gate);
        let baselines = renewed(&gate, &measured, Renewal::Everywhere);
        (measured, baselines.path_here().to_owned())
    };
    edit(&path, |json| json["baseline"]["runs"]["quick"]["devices"]["rayon on 1 thread"] = "another".into());
    let told = page(&judge(&gate(&options), &measured));
    assert!(told.lines().filter(|line| line.contains("no baseline |")).all(|line| line.contains("rayon on 1 thread")));
    assert!(told.contains("no baseline |"), "{told}");
    options.quick = false;
    let told = page(&judge(&gate(&options), &measured));
    assert!(told.contains("There is no baseline") && !told.contains("as before"), "{told}");
}

#[test]
fn a_machine_without_a_baseline_is_held_against_the_least_of_three_other_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path());
    let gate = gate(&options);
    let measured = measure(&gate);
    let baselines = renewed(&gate, &measured, Renewal::Here);
    let name = "rayon on 1 thread: sweep over bp, total";
    let [one, two, three] = ["one.json", "two.json", "three.json"].map(|name| folder.path().join(name));
    fs::rename(baselines.path_here(), &one).unwrap();
    fs::copy(&one, &two).unwrap();
    edit(&two, |json| json["baseline"]["runs"]["quick"]["speed_ups"][name] = 1e9.into());
    assert!(judge(&gate, &measured).summary().starts_with("0 of 18"));

    fs::copy(&two, &three).unwrap();
    let has_other_vectors = |json: &mut serde_json::Value| {
        let device = &mut json["baseline"]["runs"]["quick"]["devices"]["rayon on 1 thread"];
        let told = device.as_str().unwrap();
        let other =
            if told.contains("AVX2") { told.replace("AVX2", "AVX-512") } else { told.replace("AVX-512", "AVX2") };
        *device = other.into();
    };
    edit(&three, has_other_vectors);
    let judged = judge(&gate, &measured);
    assert!(judged.failures().is_empty(), "the least counts: {:?}", judged.failures());
    assert!(judged.summary().contains("18 against the least of other kinds"), "{}", judged.summary());
    edit(&one, |json| json["baseline"]["runs"]["quick"]["speed_ups"][name] = 1e8.into());
    let failures = judge(&gate, &measured).failures();
    assert!(failures.len() == 1 && failures[0].contains("was 100000000"), "{failures:?}");
}

#[test]
fn a_measurement_that_something_disturbed_fails_nothing_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path());
    let gate = gate(&options);
    let mut measured = measure(&gate);
    let baselines = renewed(&gate, &measured, Renewal::Everywhere);
    let name = "rayon on 1 thread: sweep over bp, total";
    edit(baselines.path_here(), |json| json["baseline"]["runs"]["quick"]["speed_ups"][name] = 1e9.into());
    let mut calm = judge(&gate, &measured);
    calm.repeat(&measured);
    assert_eq!(calm.failures().len(), 1);

    measured.conditions.copy_gb_per_s /= 2.0;
    let mut disturbed = judge(&gate, &measured);
    disturbed.repeat(&measured);
    assert!(disturbed.failures().is_empty() && disturbed.is_partial(), "{:?}", disturbed.failures());
    assert!(
        disturbed.summary().contains("1 not, because it is too noisy to judge: the caches copied at 50 %"),
        "{}",
        disturbed.summary()
    );
    assert!(page(&disturbed).contains("| too noisy |") && page(&disturbed).contains("* Disturbed: "));
}

#[test]
fn what_is_expected_and_not_measured_fails() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path());
    let gate = gate(&options);
    let mut measured = measure(&gate);
    let baselines = renewed(&gate, &measured, Renewal::Everywhere);
    measured.ratios.pop();
    measured.facts.remove("census: energy").expect("plans whose times are not guarded are solved too");
    edit(baselines.path_here(), |json| {
        json["baseline"]["runs"]["quick"]["devices"]["gone"] = "a device that is not here".into();
        json["baseline"]["runs"]["quick"]["speed_ups"]["gone over scalar: bp, total"] = 2.0.into();
    });
    let failures = judge(&gate, &measured).failures();
    assert!(failures.len() == 2 && failures.iter().all(|failure| failure.contains("not measured")), "{failures:?}");
    assert!(failures[0].starts_with("rayon on") && failures[1].starts_with("census: energy"), "{failures:?}");
}

#[test]
fn files_of_another_version_are_refused_and_folders_made_only_for_new_baselines() {
    let folder = tempfile::tempdir().unwrap();
    let (machine, path) = (machine::machine(None), folder.path().join("new"));
    let told = Baselines::read(&path, &machine, false).unwrap_err().to_string();
    assert!(told.contains("new") && told.contains("--baselines"), "{told}");
    let mut baselines = Baselines::read(&path, &machine, true).unwrap();
    baselines.here = Some(Baseline::new(Some(&machine)));
    baselines.write(Renewal::Here).unwrap();
    assert!(Baselines::read(&path, &machine, false).unwrap().here.is_some());
    edit(baselines.path_here(), |json| *json = serde_json::json!({ "schema_version": 99, "other": 1 }));
    let told = Baselines::read(&path, &machine, false).unwrap_err().to_string();
    assert!(told.contains("version 99") && told.contains("--update"), "{told}");
}
