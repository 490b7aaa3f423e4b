//! The claims of the thesis, each with our figure and a verdict.

use super::{BP, CFBP, CFCSBP, CTBP, CTCSBP, Named, Table};
use crate::report::{
    format::{mebibytes, number},
    results::{Part, Results, Row},
};

/// A speed-up counts as reached from this fraction of the printed one on.
const REACHED: f64 = 0.9;

/// Images whose times per pixel differ by at most this fraction have the same.
const SAME_TIME: f64 = 0.05;

/// A loss of reliability is small up to this many percentage points of pixels that are wrong by more than 1 px.
const SMALL_LOSS: f64 = 1.0;

/// The figure of a backend, and whether the claim holds there; `None` if the figure does not decide that.
type Finding = Option<(String, Option<bool>)>;

/// A claim.
struct Claim {
    what: String,
    /// Where the thesis makes it.
    place: &'static str,
    why: &'static str,
}

/// The table of claims.
pub(in crate::report) fn table(results: &Results<'_>) -> Table {
    let rows = [speeds(results), fastest(results), memories(results), reliabilities(results), others(results)].concat();
    let note = format!(
        "Means over the scenes, from this run. A speed-up is reached from {:.0} % of the printed ratio on. A loss is small up \
         to {SMALL_LOSS} percentage point of pixels wrong by more than 1 px. Software rasterisers are left out if there is \
         another backend.",
        100.0 * REACHED
    );
    let columns = ["claim", "in the thesis", "ours", "verdict", "why"];
    Table::new("A.3", "The claims of the thesis", &columns).note(note).rows(rows)
}

/// A row: the findings of all backends, and what follows from them.
fn row(results: &Results<'_>, claim: Claim, finding: impl Fn(&str) -> Finding) -> Vec<String> {
    let is_software =
        |backend: &str| results.devices().iter().any(|(name, device)| *name == backend && device.software_rasteriser);
    let mut backends: Vec<_> = results.backends().filter(|backend| !is_software(backend)).collect();
    if backends.is_empty() {
        backends = results.backends().collect();
    }
    let found: Vec<_> = backends.iter().filter_map(|backend| Some((*backend, finding(backend)?))).collect();
    let told: Vec<_> = found.iter().map(|(_, (_, holds))| *holds).collect();
    let verdict = match told.first() {
        None => "not run",
        Some(first) if told.iter().any(|holds| holds != first) => "depends on the backend",
        Some(Some(true)) => "held",
        Some(Some(false)) => "not held",
        Some(None) => "undecided",
    };
    let figures: Vec<_> =
        found.iter().map(|(backend, (figure, _))| format!("{}: {figure}", results.label(backend))).collect();
    vec![claim.what, claim.place.to_owned(), figures.join("; "), verdict.to_owned(), claim.why.to_owned()]
}

const SPEEDS: [(Named, &str, &str); 4] = [
    (CFBP, "Tables 3.18, 3.29", "it saves loops where there are many nodes, and here little else takes time"),
    (CFCSBP, "Tables 3.21, 3.29", "the same, with half of the loops"),
    (CTBP, "Tables 3.24, 3.29", "a cut saves no work; see the rows of parts side by side"),
    (CTCSBP[0], "Tables 3.26, 3.29", "half of the loops save half of the work; more needs more workers"),
];

fn speeds(results: &Results<'_>) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for (plan, place, why) in SPEEDS {
        let Some(printed) = printed_ratio(results, plan.plan) else { continue };
        let what = format!("{} is {} % faster than BP", plan.title, number(100.0 * (printed - 1.0), 0));
        rows.push(row(results, Claim { what, place, why }, |backend| {
            let ratio = results.mean(backend, |row| Some(row.speed_up(plan.plan, Part::Total)?.median))?;
            Some((format!("{} %", number(100.0 * (ratio - 1.0), 0)), Some(ratio >= REACHED * printed)))
        }));
    }
    for (whole, plan, place) in
        [("ctbp", "ctbp-side-by-side", "Table 3.24"), ("ctcsbp", "ctcsbp-side-by-side", "Table 3.26")]
    {
        let Some(printed) = printed_ratio(results, whole) else { continue };
        let what = format!(
            "{} with a worker for each part is {} times as fast as BP on one",
            whole.to_uppercase(),
            number(printed, 1)
        );
        let why = "it takes four workers; the thesis does not say on how many its programs ran";
        rows.push(row(results, Claim { what, place, why }, |backend| side_by_side(results, backend, plan, printed)));
    }
    rows
}

/// The speed-up of parts side by side, and the number of workers that the printed one would take.
fn side_by_side(results: &Results<'_>, backend: &str, plan: &str, printed: f64) -> Finding {
    let workers = results.mean(backend, |row| Some(row.workers(plan)? as f64).filter(|_| row.is_processor()))?;
    let ratio = results.mean(backend, |row| Some(row.speed_up(plan, Part::Total)?.median))?;
    let needed = printed * workers / ratio;
    let figure = format!(
        "{} times with {} workers; the printed ratio at this efficiency takes {}",
        number(ratio, 2),
        number(workers, 0),
        number(needed, 1)
    );
    Some((figure, (workers >= 4.0).then_some(ratio >= REACHED * printed)))
}

/// The mean of BP's printed time over a plan's.
pub(super) fn printed_ratio(results: &Results<'_>, plan: &str) -> Option<f64> {
    let ratio = |index| Some(results.thesis.time_ms("bp", index)? / results.thesis.time_ms(plan, index)?);
    let ratios = results.scenes().map(|(index, _)| ratio(index)).collect::<Option<Vec<f64>>>()?;
    crate::statistics::Spread::mean(ratios)
}

fn fastest(results: &Results<'_>) -> Vec<Vec<String>> {
    let what = "CTCSBP is the fastest of the four".to_owned();
    let why = "CFCSBP computes fewer messages, whatever Z'''' is";
    let claim = Claim { what, place: "in words; Table 3.29", why };
    vec![row(results, claim, |backend| {
        let ms = |plan: &Named| results.mean(backend, |row| Some(row.time(plan.plan, Part::Total)?.median));
        let times: Vec<_> =
            [CFBP, CFCSBP, CTBP, CTCSBP[0]].iter().map(|plan| Some((ms(plan)?, plan.title))).collect::<Option<_>>()?;
        let least = times.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((format!("{} with {} ms", least.1, number(least.0, 1)), Some(least.1 == CTCSBP[0].title)))
    })]
}

fn memories(results: &Results<'_>) -> Vec<Vec<String>> {
    let plans = [
        (CFBP.plan, "CFBP", "the coarser grids come on top of the finest, which is as large as BP's"),
        (CFCSBP.plan, "CFCSBP", "fewer loops change no buffer"),
        (CTBP.plan, "CTBP", "four parts are as large as the whole"),
        ("ctbp-in-turn", "CTBP, one part after another,", "only one part is in memory at a time"),
    ];
    let rows = plans.map(|(plan, name, why)| {
        let claim =
            Claim { what: format!("{name} needs less memory than BP"), place: "in words; no figure printed", why };
        row(results, claim, |backend| {
            let bytes = |row: &Row<'_>, plan: &str| Some(row.measured(plan)?.allocated_bytes as f64);
            let ratio = results.mean(backend, |row| Some(bytes(row, plan)? / bytes(row, BP.plan)?))?;
            Some((format!("{} of BP's", number(ratio, 2)), Some(ratio < 0.99)))
        })
    });
    rows.into()
}

fn reliabilities(results: &Results<'_>) -> Vec<Vec<String>> {
    let rows = [CFBP, CFCSBP, CTBP, CTCSBP[0]].map(|plan| {
        let what = format!("{} loses little reliability", plan.title);
        let why = "our data cost; the thesis prints no figure to compare with";
        row(results, Claim { what, place: "in words; no figure printed", why }, |backend| {
            let bad = |plan: &str| results.mean(backend, |row| Some(row.measured(plan)?.all.bad[1]));
            let rmse = |plan: &str| results.mean(backend, |row| Some(row.measured(plan)?.all.rmse));
            let (before, after) = (bad(BP.plan)?, bad(plan.plan)?);
            let errors = [rmse(BP.plan)?, rmse(plan.plan)?].map(|rmse| number(rmse, 1));
            let figure = format!(
                "{} instead of {} % wrong by more than 1 px, RMSE {} instead of {} px",
                number(after, 1),
                number(before, 1),
                errors[1],
                errors[0]
            );
            Some((figure, Some(after - before <= SMALL_LOSS)))
        })
    });
    rows.into()
}

fn others(results: &Results<'_>) -> Vec<Vec<String>> {
    let what = "time depends on the resolution, not on the content".to_owned();
    let why = "the work depends on the resolution only; but the reference branches on values, and other programs change our times too";
    let resolution = Claim { what, place: "in words", why };
    let what = "suitable for embedded systems".to_owned();
    let why = "neither we nor the thesis ran anything on such a system";
    let embedded = Claim { what, place: "in words", why };
    vec![
        row(results, resolution, |backend| time_per_pixel(results, backend)),
        row(results, embedded, |backend| {
            let ms = results.mean(backend, |row| Some(row.time(CFCSBP.plan, Part::Total)?.median))?;
            let bytes = results.mean(backend, |row| Some(row.measured(CFCSBP.plan)?.allocated_bytes as f64))?;
            let figure =
                format!("CFCSBP takes {} ms and {} MiB here", number(ms, 0), number(mebibytes(bytes as u64), 0));
            Some((figure, None))
        }),
    ]
}

/// By how much BP's time per pixel differs between the scenes. Times whose ranges overlap do not tell.
fn time_per_pixel(results: &Results<'_>, backend: &str) -> Finding {
    let pixels = |row: &Row<'_>| (row.scene.width * row.scene.height) as f64;
    let rows: Vec<_> = results.rows().filter(|row| row.backend == backend).collect();
    let spreads =
        rows.iter().map(|row| Some((row.time(BP.plan, Part::Total)?, pixels(row)))).collect::<Option<Vec<_>>>()?;
    let printed = rows.iter().map(|row| {
        let image = results.thesis.images.get(row.index)?;
        Some(results.thesis.time_ms(BP.plan, row.index)? / f64::from(image.width * image.height))
    });
    let (ours, printed) =
        (spread(spreads.iter().map(|(time, pixels)| time.median / pixels))?, spread(printed.flatten())?);
    let slowest = spreads.iter().map(|(time, pixels)| time.low / pixels).max_by(f64::total_cmp)?;
    let fastest = spreads.iter().map(|(time, pixels)| time.high / pixels).min_by(f64::total_cmp)?;
    let holds = if ours <= SAME_TIME { Some(true) } else { (slowest > fastest * (1.0 + SAME_TIME)).then_some(false) };
    let percent = |value: f64| number(100.0 * value, 1);
    Some((format!("BP's times per pixel differ by {} % (printed times: {} %)", percent(ours), percent(printed)), holds))
}

/// By what fraction the largest number exceeds the smallest.
fn spread(numbers: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    Some(numbers.clone().max_by(f64::total_cmp)? / numbers.min_by(f64::total_cmp)? - 1.0)
}
