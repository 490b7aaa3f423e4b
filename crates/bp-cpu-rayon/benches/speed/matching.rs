//! Message updates and whole matches.

use bp_core::{Algorithm, Backend, Profile, Schedule, Size};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;

use crate::{
    Bench, Failure, THREADS,
    pairs::Scene,
    report::{Group, Measured, Ratio},
    solve::{Case, Of, Prepared, contestant, facts_of_answer, hierarchy, instruction_sets, sweep, threads},
    turns::{Contestant, in_turns, ratio},
};

/// Rounds of a full run.
const ROUNDS: usize = 15;

/// Rounds of the scalar backend, which takes a second or more.
const SCALAR_ROUNDS: usize = 9;

/// Half-steps of the message update, by threads, instruction sets and backends.
pub(crate) fn update(bench: &Bench) -> Result<Group, Failure> {
    let scene = bench.data.baby1()?;
    let settings = hierarchy(scene.pair.size(), 1, 10);
    let case = Case { scene: &scene, profile: Profile::Census, labels: 128, settings };
    let sets = instruction_sets();
    let rounds = bench.rounds(ROUNDS);
    let rayon = |device: usize, count: usize, asked| {
        let prepared = Prepared::new(bench.pool(count), (&Rayon as &dyn Backend, device), &case)?;
        Ok::<_, Failure>(contestant(on(&sets[device], count), Of::Updates, rounds, asked, prepared))
    };
    let mut contestants = vec![rayon(0, 1, [Some(0.06), Some(0.045)])?, rayon(0, 2, [Some(0.035), Some(0.025)])?];
    for device in 1..sets.len() {
        contestants.push(rayon(device, 1, [None, None])?);
    }
    let scalar = Prepared::new(bench.pool(1), (&Scalar, 0), &case)?;
    contestants.push(contestant("scalar".to_owned(), Of::Updates, bench.rounds(SCALAR_ROUNDS), [None, None], scalar));
    let measured = in_turns(contestants)?;
    let ratios = update_ratios(&measured, &sets);
    let title =
        format!("Message update alone: {}, 128 labels, census, 1 grid, 10 checkerboard half-steps.", scene.described());
    Ok(Group { name: "update", title, measured, ratios, ..Group::default() })
}

/// A contestant of [`update`].
fn on(set: &str, count: usize) -> String {
    format!("rayon, {set}, {}", threads(count))
}

fn update_ratios(measured: &[Measured], sets: &[String]) -> Vec<Ratio> {
    let [one, two] = THREADS.map(|count| on(&sets[0], count));
    let mut ratios = vec![
        ratio(measured, &one, &two, Some("at least 1.7")),
        ratio(measured, "scalar", &one, None),
        ratio(measured, "scalar", &two, None),
    ];
    ratios.extend(sets[1..].iter().map(|set| ratio(measured, &on(set, 1), &one, None)));
    ratios.into_iter().flatten().collect()
}

/// The hierarchy and the sweep, from images to labels.
pub(crate) fn whole_match(bench: &Bench) -> Result<Group, Failure> {
    let scene = bench.data.baby1()?;
    let size = scene.pair.size();
    let case = |settings| Case { scene: &scene, profile: Profile::Census, labels: 128, settings };
    let rounds = bench.rounds(ROUNDS);
    let hierarchy = on_both(bench, "hierarchy 5 x 10", &case(hierarchy(size, 5, 10)), rounds, HIERARCHY)?;
    let sweep = on_both(bench, "sweep", &case(sweep(size)), rounds, SWEEP)?;
    let energies = [&sweep, &hierarchy].map(|contestants| contestants[0].facts["energy"]);
    let measured = in_turns(hierarchy.into_iter().chain(sweep).collect())?;
    let ratios = [
        ("hierarchy 5 x 10, 1 thread", "hierarchy 5 x 10, 2 threads", Some("at least 1.7")),
        ("sweep, 1 thread", "sweep, 2 threads", Some("at least 1.7")),
        ("hierarchy 5 x 10, 1 thread", "sweep, 1 thread", None),
        ("hierarchy 5 x 10, 2 threads", "sweep, 2 threads", None),
    ];
    let title = format!("Whole match: {}, 128 labels, census, from images to labels.", scene.described());
    let ratios =
        ratios.into_iter().filter_map(|(first, second, asked)| ratio(&measured, first, second, asked)).collect();
    let note =
        format!("Energy of the sweep over that of the hierarchy: {:.4} (asked: at most 1).", energies[0] / energies[1]);
    Ok(Group { name: "match", title, notes: vec![note], measured, ratios, ..Group::default() })
}

/// The most asked for and the goal, in milliseconds, on 1 thread and on 2.
type Asked = [[Option<f64>; 2]; 2];

const HIERARCHY: Asked = [[Some(130.0), Some(65.0)], [Some(70.0), Some(35.0)]];
const SWEEP: Asked = [[Some(36.0), Some(20.0)], [Some(24.0), Some(12.0)]];

/// A whole match on 1 thread and on 2.
fn on_both<'a>(
    bench: &'a Bench,
    name: &str,
    case: &Case<'a>,
    rounds: usize,
    asked: Asked,
) -> Result<Vec<Contestant<'a>>, Failure> {
    let on = |(count, asked): (usize, [Option<f64>; 2])| {
        let prepared = Prepared::new(bench.pool(count), (&Rayon, 0), case)?;
        let facts = facts_of_answer(case.scene, &prepared.driver)?;
        let mut contestant = contestant(format!("{name}, {}", threads(count)), Of::Total, rounds, asked, prepared);
        contestant.facts.extend(facts);
        Ok(contestant)
    };
    THREADS.into_iter().zip(asked).map(on).collect()
}

/// The pairs that other programs are known by.
pub(crate) fn peers(bench: &Bench) -> Result<Group, Failure> {
    let pair = |name, width, height, labels, scale| {
        Ok::<_, Failure>((bench.data.middlebury_v2(name, Size { width, height }, labels, scale)?, labels))
    };
    let scenes = [
        (pair("tsukuba", 384, 288, 16, 16.0)?, 1.0),
        (pair("cones", 450, 375, 64, 4.0)?, 6.0),
        ((bench.data.aloe(112)?, 112), 25.0),
    ];
    let mut contestants = vec![];
    for ((scene, labels), asked) in &scenes {
        let settings = sweep(scene.pair.size());
        let case = Case { scene, profile: Profile::Census, labels: *labels, settings };
        let name = format!("{}, {labels} labels", scene.name);
        let asked = [[None; 2], [Some(*asked), None]];
        contestants.extend(on_both(bench, &name, &case, bench.rounds(ROUNDS), asked)?);
    }
    let measured = in_turns(contestants)?;
    let speed_up = |((scene, labels), _): &((Scene, usize), f64)| {
        let name = |count| format!("{}, {labels} labels, {}", scene.name, threads(count));
        ratio(&measured, &name(1), &name(2), None)
    };
    let ratios = scenes.iter().filter_map(speed_up).collect();
    let title = "Whole match by sweep, census, from images to labels.".to_owned();
    let note = "Wrong: by more than 1 pixel, of all pixels of known truth; visible: of those that the right camera \
                sees too and that lie at least as many columns from the left edge as there are labels.";
    Ok(Group { name: "peers", title, notes: vec![note.to_owned()], measured, ratios, ..Group::default() })
}

/// The thesis's profile and loops.
pub(crate) fn thesis(bench: &Bench) -> Result<Group, Failure> {
    let scene = bench.data.baby1()?;
    let size = scene.pair.size();
    let rounds = bench.rounds(ROUNDS);
    let on_both = |name: &str, algorithm: Algorithm, ms: f64| {
        let settings = algorithm.settings(size, 112, 2, Schedule::Sync);
        let case = Case { scene: &scene, profile: Profile::Thesis, labels: 112, settings };
        on_both(bench, name, &case, rounds, [[None; 2], [Some(ms), None]])
    };
    let mut contestants = on_both("BP, 112 loops", Algorithm::Bp, 700.0)?;
    contestants.extend(on_both("CFCSBP, Z'' = 2", Algorithm::Cfcsbp, 60.0)?);
    let measured = in_turns(contestants)?;
    let speed_up = |name: &str| {
        ratio(&measured, &format!("{name}, 1 thread"), &format!("{name}, 2 threads"), Some("at least 1.7"))
    };
    let ratios = ["BP, 112 loops", "CFCSBP, Z'' = 2"].into_iter().filter_map(speed_up).collect();
    let title = format!(
        "The thesis's profile: {}, L = k = 112, synchronous schedule, from images to labels.",
        scene.described()
    );
    Ok(Group { name: "thesis", title, measured, ratios, ..Group::default() })
}
