//! The tables of the thesis, 3.1 to 3.29, and ours.

pub(super) mod claims;
mod compared;
pub(super) mod means;
mod measured;
pub(super) mod ours;
pub(super) mod pixels;
pub(super) mod readings;
mod setting;

use super::results::Results;

/// A table.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    /// Its number, such as "3.18".
    pub(super) number: String,
    /// Its heading.
    pub(super) title: String,
    /// The data that it was measured on, if not the run's six scenes.
    pub(super) data: Option<String>,
    /// How to read it.
    pub(super) note: String,
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(number: &str, title: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        Self { number: number.to_owned(), title: title.into(), columns, ..Self::default() }
    }

    /// The same with a note.
    pub(super) fn note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// The same with rows.
    pub(super) fn rows(self, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        Self { rows: rows.into_iter().collect(), ..self }
    }
}

/// A plan as tables and charts show it: one name and one shape everywhere.
#[derive(Clone, Copy)]
pub(super) struct Named {
    /// Name in the record.
    pub(super) plan: &'static str,
    /// Name in tables and charts.
    pub(super) title: &'static str,
    /// The thesis's algorithm, if it prints numbers for this plan.
    pub(super) printed: Option<&'static str>,
    /// The number of its marker, which no other plan has.
    pub(super) look: usize,
    /// The plan in words.
    pub(super) meaning: &'static str,
}

impl Named {
    /// Whether the image is cut into four parts.
    fn is_cut(&self) -> bool {
        self.plan.starts_with("ct")
    }
}

/// A plan of the thesis whose parts have plans of their own.
const fn of_parts(look: usize, plan: &'static str, title: &'static str, meaning: &'static str) -> Named {
    Named { printed: None, ..named(look, plan, title, meaning) }
}

/// A plan of the thesis.
const fn named(look: usize, plan: &'static str, title: &'static str, meaning: &'static str) -> Named {
    Named { plan, title, printed: Some(plan), look, meaning }
}

pub(super) const BP: Named =
    named(0, "bp", "BP", "belief propagation on the whole image; all others are compared with it");
pub(super) const CFBP: Named = named(1, "cfbp", "CFBP", "coarse-to-fine BP");
pub(super) const CFCSBP: Named = named(2, "cfcsbp", "CFCSBP, Z''=2", "coarse-to-fine constant-space BP");
pub(super) const CTBP: Named = named(3, "ctbp", "CTBP", "census-transform BP, which cuts the image into four parts");
/// The thesis's text lacks the digit of Z'''', so its printed numbers appear beside each of the three.
pub(super) const CTCSBP: [Named; 3] = [
    named(4, "ctcsbp", "CTCSBP, Z''''=2", "census-transform constant-space BP, with half of CTBP's loops"),
    Named {
        printed: Some("ctcsbp"),
        ..named(5, "ctcsbp-z3", "CTCSBP, Z''''=3", "the same with a third of CTBP's loops")
    },
    Named {
        printed: Some("ctcsbp"),
        ..named(6, "ctcsbp-z4", "CTCSBP, Z''''=4", "the same with a quarter of CTBP's loops")
    },
];

/// CTBP and CTCSBP with their parts arranged otherwise.
const OF_PARTS: [Named; 4] = [
    of_parts(11, "ctbp-side-by-side", "CTBP, side by side", "CTBP, each part on a worker of its own"),
    of_parts(12, "ctbp-in-turn", "CTBP, in turn", "CTBP, one part after another in the memory of one"),
    of_parts(13, "ctcsbp-side-by-side", "CTCSBP, Z''''=2, side by side", "CTCSBP, each part on a worker of its own"),
    of_parts(14, "ctcsbp-in-turn", "CTCSBP, Z''''=2, in turn", "CTCSBP, one part after another in the memory of one"),
];

/// These plans and, if the record has them, the same with their parts arranged otherwise.
pub(super) fn with_parts(results: &Results<'_>, plans: &[Named]) -> Vec<Named> {
    let is_run = |named: &&Named| results.record.cells.iter().any(|cell| cell.plan == named.plan);
    let is_of = |named: &&Named| plans.iter().any(|plan| named.plan.starts_with(&format!("{}-", plan.plan)));
    plans.iter().chain(OF_PARTS.iter().filter(is_run).filter(is_of)).copied().collect()
}

/// The tables of one algorithm: its plans, and the numbers of its speed, memory and reliability.
const SINGLE: [(&[Named], [&str; 3]); 5] = [
    (&[BP], ["3.3", "3.4", "3.5"]),
    (&[CFBP], ["3.6", "3.7", "3.8"]),
    (&[CFCSBP], ["3.9", "3.10", "3.11"]),
    (&[CTBP], ["3.12", "3.13", "3.14"]),
    (&CTCSBP, ["3.15", "3.16", "3.17"]),
];

/// All tables, in order.
pub(super) fn all(results: &Results<'_>) -> Vec<Table> {
    let mut tables = vec![setting::computer(results), setting::images(results)];
    for (plans, [speed, memory, reliability]) in SINGLE {
        let plans = &with_parts(results, plans);
        tables.push(measured::speed(results, speed, plans));
        tables.push(measured::memory(results, memory, plans));
        tables.push(measured::reliability(results, reliability, plans));
    }
    let against_bp: [(&[Named], [&str; 3]); 4] = [
        (&[CFBP], ["3.18", "3.19", "3.20"]),
        (&[CFCSBP], ["3.21", "3.22", "3.23"]),
        (&[CTBP], ["3.24", "3.25a", "3.25"]),
        (&CTCSBP, ["3.26", "3.27", "3.28"]),
    ];
    for (plans, [speed, memory, reliability]) in against_bp {
        let plans = &with_parts(results, plans);
        tables.push(compared::speed(results, speed, plans));
        tables.push(compared::memory(results, memory, plans));
        tables.push(compared::reliability(results, reliability, plans));
    }
    tables.push(compared::all_speeds(results));
    tables.push(compared::all_memory(results));
    tables.push(compared::all_reliability(results));
    tables.push(ours::profiles(results));
    tables.extend(ours::energies(results));
    tables.push(claims::table(results));
    tables.extend(readings::table(results));
    tables.push(pixels::table(results));
    tables
}

/// All plans of the thesis.
pub(super) fn thesis_plans() -> Vec<Named> {
    [BP, CFBP, CFCSBP, CTBP].into_iter().chain(CTCSBP).collect()
}

/// The algorithm that plans belong to.
pub(super) fn family(plans: &[Named]) -> &'static str {
    plans.first().map_or("", |plan| plan.title.split(',').next().unwrap_or(plan.title))
}
