//! The formats of two programs that track times from commit to commit.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{setting, times};
use crate::{record::Record, report::format::number};

/// An entry of github-action-benchmark's `customSmallerIsBetter`.
#[derive(Serialize)]
struct Entry {
    name: String,
    unit: &'static str,
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<String>,
    extra: String,
}

/// The input of github-action-benchmark's tool `customSmallerIsBetter`.
pub(super) fn github_action_benchmark(record: &Record) -> Value {
    let entries = times(record).into_iter().map(|time| Entry {
        name: format!("{}: {}", time.name(record), time.part),
        unit: "ms",
        value: time.ms,
        range: time.interval_ms.map(|[low, high]| format!("{} to {}", number(low, 3), number(high, 3))),
        extra: format!("{}; {}", time.device(), setting(record)),
    });
    json!(entries.collect::<Vec<_>>())
}

/// Bencher Metric Format. Bencher's own measure `latency` is in nanoseconds.
pub(super) fn bencher(record: &Record) -> Value {
    let ns = |ms: f64| 1e6 * ms;
    let mut benchmarks = Map::new();
    for time in times(record) {
        let latency = match time.interval_ms {
            Some([low, high]) => json!({ "value": ns(time.ms), "lower_value": ns(low), "upper_value": ns(high) }),
            None => json!({ "value": ns(time.ms) }),
        };
        let name = format!("{}: {}", time.name(record), time.part);
        benchmarks.insert(name, json!({ "latency": latency }));
    }
    Value::Object(benchmarks)
}
