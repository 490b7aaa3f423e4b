//! A record as a Vega-Lite chart.

use serde_json::{Value, json};

use super::{setting, times};
use crate::{escape::printable, record::Record};

/// Total times of every plan and backend, with their intervals. The chart includes its data.
pub(super) fn chart(record: &Record) -> Value {
    let times = times(record).into_iter().filter(|time| time.part == "total");
    let values = times.map(|time| {
        let [low, high] = time.interval_ms.unwrap_or([time.ms; 2]);
        let [plan, backend] = [time.group.plan, time.group.backend].map(printable);
        json!({ "plan": plan, "backend": backend, "device": time.device(), "ms": time.ms, "low": low, "high": high })
    });
    let values: Vec<_> = values.collect();
    // All layers give their common axis the same title; otherwise Vega-Lite would join their titles.
    let title = "total time, ms";
    let y = |field: &str| json!({ "field": field, "type": "quantitative", "title": title, "scale": { "type": "log" } });
    let tooltip = ["plan", "backend", "device", "ms", "low", "high"].map(|field| json!({ "field": field }));
    json!({
        "$schema": "https://vega.github.io/schema/vega-lite/v5.json",
        "title": { "text": "Time by plan and backend", "subtitle": setting(record) },
        "description": "Total time of every plan on every backend, in milliseconds on a logarithmic axis: means over \
                        the scenes of medians, with 95 % bootstrap intervals from three samples of every scene on.",
        "data": { "values": values },
        "encoding": {
            "x": { "field": "plan", "type": "nominal", "sort": null, "title": "plan" },
            "xOffset": { "field": "backend" },
            "color": { "field": "backend", "type": "nominal", "title": "backend" },
        },
        "layer": [
            { "mark": "rule", "encoding": { "y": y("low"), "y2": { "field": "high" } } },
            { "mark": { "type": "point", "filled": true }, "encoding": { "y": y("ms"), "tooltip": tooltip } },
        ],
    })
}
