//! Looks of charts that show several plans on several backends: shapes tell the plans, colours the backends.

use bp_charts::{BLACK, Key, Line, Style};

use super::results::Results;

/// The look of the numbered plan on the numbered device.
pub(super) fn style(plan: usize, device: usize) -> Style {
    Style::marked(device, plan)
}

/// The look of the numbered plan on whichever device.
pub(super) fn any_device(plan: usize) -> Style {
    Style::marked(BLACK, plan)
}

/// What the shapes of these plans mean, and the colours of all devices.
pub(super) fn keys(results: &Results<'_>, plans: impl IntoIterator<Item = (usize, String)>) -> Vec<Key> {
    let plans = plans.into_iter().map(|(plan, name)| Key { name, style: any_device(plan) });
    let devices = results.devices().into_iter().enumerate();
    let devices =
        devices.map(|(i, (backend, _))| Key { name: results.label(backend), style: Style::line(i, Line::Solid) });
    plans.chain(devices).collect()
}
