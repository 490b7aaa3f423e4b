//! How kernels share out nodes and labels.

use std::env;

use bp_core::DeviceKind;

/// The variable of the environment that names a shape, to measure one beside the other.
const VARIABLE: &str = "BP_GPU_SHAPE";

/// How kernels share out nodes and labels among invocations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// An invocation has a word of four nodes, all of their labels and all sides: each operation works on sixteen bytes.
    Words,
    /// An invocation has a word and a slice of the labels, and while messages are passed one side.
    Slices,
}

impl Shape {
    /// The shape for a device of this kind: slices for GPUs, and words for processors. The variable `BP_GPU_SHAPE` chooses one
    /// by its name: `words` or `slices`.
    ///
    /// # Errors
    /// If the variable has another value.
    pub fn of(kind: DeviceKind) -> Result<Self, String> {
        env::var_os(VARIABLE).map_or_else(|| Ok(Self::suits(kind)), |name| Self::named(&name.to_string_lossy()))
    }

    fn suits(kind: DeviceKind) -> Self {
        match kind {
            DeviceKind::Processor | DeviceKind::SoftwareRasteriser => Self::Words,
            DeviceKind::DiscreteGpu | DeviceKind::IntegratedGpu | DeviceKind::VirtualGpu | DeviceKind::Other => {
                Self::Slices
            }
        }
    }

    fn named(name: &str) -> Result<Self, String> {
        match name {
            "words" => Ok(Self::Words),
            "slices" => Ok(Self::Slices),
            _ => Err(format!("{VARIABLE}={name} is neither words nor slices")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_share_out_labels_and_processors_do_not() {
        for kind in DeviceKind::ALL {
            let processor = [DeviceKind::Processor, DeviceKind::SoftwareRasteriser].contains(&kind);
            let expected = if processor { Shape::Words } else { Shape::Slices };
            assert_eq!(Shape::suits(kind), expected, "{kind:?}");
        }
    }

    #[test]
    fn a_shape_can_be_asked_for_by_its_name() {
        assert_eq!(Shape::named("words"), Ok(Shape::Words));
        assert_eq!(Shape::named("slices"), Ok(Shape::Slices));
        assert_eq!(Shape::named("two"), Err("BP_GPU_SHAPE=two is neither words nor slices".to_owned()));
    }
}
