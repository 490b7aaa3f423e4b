//! How kernels share out the nodes.

use std::env;

use bp_core::DeviceKind;

/// The variable of the environment that names a shape, to measure one beside the other.
const VARIABLE: &str = "BP_GPU_SHAPE";

/// How kernels share out the nodes among invocations, and in which order vectors hold bytes; see `shared.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Four nodes an invocation: each operation works on sixteen bytes.
    FourNodes,
    /// One node an invocation while messages are passed.
    OneNode,
}

impl Shape {
    /// The shape for a device of this kind: one node an invocation for GPUs, and four for processors. The variable
    /// `BP_GPU_SHAPE` chooses one by its name: `four-nodes` or `one-node`.
    ///
    /// # Errors
    /// If the variable has another value.
    pub fn of(kind: DeviceKind) -> Result<Self, String> {
        env::var_os(VARIABLE).map_or_else(|| Ok(Self::suits(kind)), |name| Self::named(&name.to_string_lossy()))
    }

    fn suits(kind: DeviceKind) -> Self {
        match kind {
            DeviceKind::Processor | DeviceKind::SoftwareRasteriser => Self::FourNodes,
            DeviceKind::DiscreteGpu | DeviceKind::IntegratedGpu | DeviceKind::VirtualGpu | DeviceKind::Other => {
                Self::OneNode
            }
        }
    }

    fn named(name: &str) -> Result<Self, String> {
        match name {
            "four-nodes" => Ok(Self::FourNodes),
            "one-node" => Ok(Self::OneNode),
            _ => Err(format!("{VARIABLE}={name} is neither four-nodes nor one-node")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_compute_one_node_and_processors_four() {
        for kind in DeviceKind::ALL {
            let processor = [DeviceKind::Processor, DeviceKind::SoftwareRasteriser].contains(&kind);
            let expected = if processor { Shape::FourNodes } else { Shape::OneNode };
            assert_eq!(Shape::suits(kind), expected, "{kind:?}");
        }
    }

    #[test]
    fn a_shape_can_be_asked_for_by_its_name() {
        assert_eq!(Shape::named("four-nodes"), Ok(Shape::FourNodes));
        assert_eq!(Shape::named("one-node"), Ok(Shape::OneNode));
        assert_eq!(Shape::named("two"), Err("BP_GPU_SHAPE=two is neither four-nodes nor one-node".to_owned()));
    }
}
