//! Measuring in turns.

use std::collections::BTreeMap;

use bp_core::Stage;

use crate::{
    Failure,
    report::{Measured, Ratio},
    statistics::{interval, median, range},
};

/// One measurement.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    /// In the contestant's unit.
    pub(crate) value: f64,
    /// Of a solve: its stages in milliseconds.
    pub(crate) stages_ms: Option<[f64; Stage::ALL.len()]>,
}

/// What is measured.
pub(crate) struct Contestant<'a> {
    /// Its name, unique in its group.
    pub(crate) name: String,
    /// Of the values.
    pub(crate) unit: &'static str,
    /// It takes part in so many of the first rounds.
    pub(crate) rounds: usize,
    /// The most that is asked for, and the goal.
    pub(crate) asked: [Option<f64>; 2],
    /// What else is known of it, by name.
    pub(crate) facts: BTreeMap<&'static str, f64>,
    /// Measures once.
    pub(crate) run: Box<dyn FnMut() -> Result<Sample, Failure> + 'a>,
}

/// Runs rounds until every contestant had its own; each round runs each of them once, one after another.
pub(crate) fn in_turns(mut contestants: Vec<Contestant<'_>>) -> Result<Vec<Measured>, Failure> {
    let mut samples = vec![Vec::new(); contestants.len()];
    let rounds = contestants.iter().map(|contestant| contestant.rounds).max().unwrap_or(0);
    for round in 0..rounds {
        for (contestant, samples) in contestants.iter_mut().zip(&mut samples) {
            if round < contestant.rounds {
                samples.push((contestant.run)()?);
            }
        }
    }
    Ok(contestants.into_iter().zip(samples).map(|(contestant, samples)| measured(contestant, &samples)).collect())
}

fn measured(contestant: Contestant<'_>, samples: &[Sample]) -> Measured {
    let values: Vec<f64> = samples.iter().map(|sample| sample.value).collect();
    let [min, max] = range(&values);
    Measured {
        name: contestant.name,
        unit: contestant.unit,
        median: median(&values),
        min,
        max,
        asked: contestant.asked[0],
        goal: contestant.asked[1],
        facts: contestant.facts,
        stages_ms: samples.iter().filter_map(|sample| sample.stages_ms).collect(),
        samples: values,
    }
}

/// How many times the value of `first` that of `second` is, round by round; `None` where one was not measured.
pub(crate) fn ratio(measured: &[Measured], first: &str, second: &str, asked: Option<&'static str>) -> Option<Ratio> {
    let samples = |name: &str| Some(measured.iter().find(|m| m.name == name)?.samples.iter());
    let ratios: Vec<f64> = samples(first)?.zip(samples(second)?).map(|(a, b)| a / b).collect();
    let [low, high] = interval(&ratios);
    let (first, second) = (first.to_owned(), second.to_owned());
    Some(Ratio { first, second, median: median(&ratios), low, high, asked, samples: ratios })
}
