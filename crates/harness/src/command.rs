//! One file a command.

pub(crate) mod evaluate;
pub(crate) mod match_pair;
pub(crate) mod scenes;

pub(crate) use evaluate::evaluate;
pub(crate) use match_pair::match_pair;
pub(crate) use scenes::scenes;
