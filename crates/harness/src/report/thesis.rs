//! The numbers that the thesis prints, from `data/thesis.json`.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::failure::Failure;

/// The printed numbers.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Thesis {
    #[expect(dead_code, reason = "for readers of the file")]
    about: String,
    /// Table 3.1: parts of the computer and their descriptions.
    pub(super) computer: Vec<(String, String)>,
    /// Table 3.2.
    pub(super) images: Vec<PrintedImage>,
    /// Milliseconds by algorithm, one entry per image.
    times_ms: BTreeMap<String, [f64; 6]>,
    /// Speed-ups over BP in percent by algorithm, one entry per image.
    speed_up_percent: BTreeMap<String, [f64; 6]>,
}

/// A row of Table 3.2.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PrintedImage {
    pub(super) name: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) disparity_true: u32,
    #[cfg_attr(not(test), expect(dead_code, reason = "a test holds it against the scenes that are run"))]
    pub(super) scene: String,
}

impl Thesis {
    /// Parses the numbers, which are built into the program.
    pub(super) fn read() -> Result<Self, Failure> {
        let text = include_str!("../../data/thesis.json");
        serde_json::from_str(text).map_err(|error| Failure::other(format!("crates/harness/data/thesis.json: {error}")))
    }

    /// The printed time of an algorithm on image `index`.
    pub(super) fn time_ms(&self, algorithm: &str, index: usize) -> Option<f64> {
        self.times_ms.get(algorithm)?.get(index).copied()
    }

    /// The printed speed-up of an algorithm over BP on image `index`, in percent.
    pub(super) fn speed_up_percent(&self, algorithm: &str, index: usize) -> Option<f64> {
        self.speed_up_percent.get(algorithm)?.get(index).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The printed speed-ups are `(T_BP / T - 1) * 100` of the printed times, all 24 to both decimals. A mistake in our
    /// copy would break that.
    #[test]
    fn printed_speed_ups_follow_from_printed_times() {
        let thesis = Thesis::read().unwrap();
        for (algorithm, percents) in &thesis.speed_up_percent {
            for (index, printed) in percents.iter().enumerate() {
                let [bp, time] = ["bp", algorithm].map(|name| thesis.time_ms(name, index).unwrap());
                let computed = (bp / time - 1.0) * 100.0;
                assert!((computed - printed).abs() <= 0.005 + 1e-9, "{algorithm} {index}: {computed} {printed}");
            }
        }
        assert_eq!(thesis.speed_up_percent.len() * 6, 24);
        let scenes: Vec<_> = thesis.images.iter().map(|image| image.scene.as_str()).collect();
        assert_eq!(scenes, crate::scenes::THESIS_SCENES);
    }
}
