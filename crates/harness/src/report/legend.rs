//! How charts show plans and devices: a marker's shape identifies the plan, its colour the device.

use bp_charts::{BLACK, Key, Line, Style};

use super::{results::Results, tables::Named};

/// The look of a plan on the numbered device. With one device, colours tell the plans apart too.
pub(super) fn style(results: &Results<'_>, plan: &Named, device: usize) -> Style {
    Style::marked(if has_one_device(results) { plan.look } else { device }, plan.look)
}

/// The look of a plan regardless of the device, as in a legend.
pub(super) fn any_device(results: &Results<'_>, plan: &Named) -> Style {
    style(results, plan, BLACK)
}

/// The legend's entries for devices. A single device needs none unless it is a software rasteriser.
pub(super) fn devices(results: &Results<'_>) -> Vec<Key> {
    let devices = results.devices();
    let is_plain = results.backends().count() == 1 && devices.iter().all(|(_, device)| !device.software_rasteriser);
    let colour = |i| if has_one_device(results) { BLACK } else { i };
    let key = |(i, (backend, _)): (usize, &(&str, _))| Key {
        name: results.label(backend),
        style: Style::line(colour(i), Line::Solid),
    };
    devices.iter().enumerate().filter(|_| !is_plain).map(key).collect()
}

fn has_one_device(results: &Results<'_>) -> bool {
    results.devices().len() <= 1
}
