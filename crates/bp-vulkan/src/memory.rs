//! The choice of memory for buffers.

use ash::vk;
use bp_gpu::Memory;

/// The heap of [`Memory::Device`].
pub(crate) fn device_heap(memory: &vk::PhysicalDeviceMemoryProperties) -> Option<usize> {
    let kind = memory_type(memory, Memory::Device, u32::MAX)?;
    Some(memory.memory_types[kind as usize].heap_index as usize)
}

/// The type of memory for such buffers, among those allowed: the first with all desired properties, otherwise the first
/// with the required ones. Drivers list the fastest types first.
pub(crate) fn memory_type(
    properties: &vk::PhysicalDeviceMemoryProperties,
    memory: Memory,
    allowed: u32,
) -> Option<u32> {
    let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    let (needed, wished) = match memory {
        Memory::Device => (vk::MemoryPropertyFlags::empty(), vk::MemoryPropertyFlags::DEVICE_LOCAL),
        Memory::Upload => (visible, visible),
        Memory::Download => (visible, visible | vk::MemoryPropertyFlags::HOST_CACHED),
    };
    let first = |flags| {
        let types = properties.memory_types_as_slice().iter().zip(0_u32..);
        types.filter(|&(_, i)| allowed >> i & 1 == 1).find(|(kind, _)| kind.property_flags.contains(flags))
    };
    first(wished).or_else(|| first(needed)).map(|(_, i)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_chosen_by_use() {
        let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let cached = visible | vk::MemoryPropertyFlags::HOST_CACHED;
        let mut properties = vk::PhysicalDeviceMemoryProperties { memory_type_count: 4, ..Default::default() };
        for (i, flags) in [vk::MemoryPropertyFlags::empty(), local, visible, cached].into_iter().enumerate() {
            properties.memory_types[i].property_flags = flags;
        }
        let chosen = |memory, allowed| memory_type(&properties, memory, allowed);
        assert_eq!(chosen(Memory::Device, u32::MAX), Some(1));
        assert_eq!(chosen(Memory::Upload, u32::MAX), Some(2));
        assert_eq!(chosen(Memory::Download, u32::MAX), Some(3));
        assert_eq!(chosen(Memory::Download, 0b0111), Some(2));
        assert_eq!(chosen(Memory::Device, 0b1001), Some(0));
        assert_eq!(chosen(Memory::Upload, 0b0011), None);
    }
}
