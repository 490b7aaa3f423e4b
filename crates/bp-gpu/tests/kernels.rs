//! The WGSL files are valid, and their declarations match the Rust side.

use bp_gpu::{Access, Kernel, Parameters};
use naga::{
    AddressSpace, Module, StorageAccess, TypeInner,
    front::wgsl,
    valid::{Capabilities, ValidationFlags, Validator},
};

fn module(kernel: Kernel) -> Module {
    let source = kernel.source();
    let module = wgsl::parse_str(&source);
    module.unwrap_or_else(|error| panic!("{}: {}", kernel.name(), error.emit_to_string(&source)))
}

#[test]
fn every_kernel_is_valid_wgsl() {
    for kernel in Kernel::ALL {
        let module = module(kernel);
        let checked = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        checked.unwrap_or_else(|error| panic!("{}: {}", kernel.name(), error.emit_to_string(&kernel.source())));
        let [entry] = module.entry_points.as_slice() else { panic!("{}: one entry point", kernel.name()) };
        assert_eq!(entry.name, kernel.name());
        match entry.workgroup_size_overrides {
            Some(_) => assert!(kernel.is_sliced(), "{}", entry.name),
            None => assert_eq!(entry.workgroup_size, [bp_gpu::WORKGROUP, 1, 1]),
        }
    }
}

#[test]
fn bindings_are_those_declared() {
    for kernel in Kernel::ALL {
        let mut found: Vec<_> = module(kernel)
            .global_variables
            .iter()
            .filter_map(|(_, variable)| {
                let AddressSpace::Storage { access } = variable.space else { return None };
                let written = access.contains(StorageAccess::STORE);
                Some((variable.binding.unwrap().binding, if written { Access::Write } else { Access::Read }))
            })
            .collect();
        found.sort_by_key(|(binding, _)| *binding);
        let expected = std::iter::once(&Access::Read).chain(kernel.bindings());
        assert_eq!(found, (0..).zip(expected.copied()).collect::<Vec<_>>(), "{}", kernel.name());
    }
}

/// The host writes the struct that kernels read.
#[test]
fn parameters_have_the_layout_of_the_wgsl_struct() {
    for kernel in Kernel::ALL {
        let module = module(kernel);
        let is_it = |ty: &&naga::Type| ty.name.as_deref() == Some("Parameters");
        let ty = module.types.iter().map(|(_, ty)| ty).find(is_it).unwrap();
        let TypeInner::Struct { members, span } = &ty.inner else { panic!("Parameters is a struct") };
        assert_eq!(*span as usize, size_of::<Parameters>());
        let found: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        assert_eq!(found, Parameters::FIELDS);
    }
}
