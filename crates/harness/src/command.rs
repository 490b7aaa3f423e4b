//! One file a command, and `plan`, which `bp match` runs.

pub(crate) mod evaluate;
pub(crate) mod match_pair;
mod plan;
pub(crate) mod scenes;

pub(crate) use evaluate::evaluate;
pub(crate) use match_pair::match_pair;
pub(crate) use scenes::scenes;
