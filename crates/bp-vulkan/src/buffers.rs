//! The buffers of a program and their memory, in as few allocations as the device allows.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{ptr::NonNull, slice, sync::Arc};

use ash::vk;
use bp_core::Error;
use bp_gpu::{Buffer, Memory};

use crate::{gpu::Gpu, memory::memory_type, object::Owned};

/// Buffers, by their index in the program.
pub(crate) struct Buffers {
    buffers: Vec<Placed>,
    /// The memory of the buffers. It is freed after they are destroyed.
    blocks: Vec<Owned<vk::DeviceMemory>>,
    bytes: u64,
}

/// A buffer that is bound to memory.
struct Placed {
    raw: Owned<vk::Buffer>,
    memory: Memory,
    bytes: u64,
    /// Its address on the host, if it is mapped.
    mapped: Option<NonNull<u8>>,
}

// SAFETY: only the buffer has its mapped address, which is read and written only through references to the buffer.
unsafe impl Send for Placed {}

impl Buffers {
    /// Makes buffers. Sets mapped ones to zeros, so that no page is first touched while a solve is timed.
    pub(crate) fn new(gpu: &Arc<Gpu>, wanted: &[Buffer]) -> Result<Self, Error> {
        let buffers = wanted.iter().map(|buffer| create(gpu, buffer)).collect::<Result<_, _>>()?;
        let mut buffers = Self { buffers, blocks: Vec::new(), bytes: 0 };
        for memory in [Memory::Device, Memory::Upload, Memory::Download] {
            buffers.place(gpu, memory)?;
        }
        Ok(buffers)
    }

    /// Allocates memory for the buffers of one kind.
    fn place(&mut self, gpu: &Arc<Gpu>, memory: Memory) -> Result<(), Error> {
        let members: Vec<_> = (0..self.buffers.len()).filter(|&i| self.buffers[i].memory == memory).collect();
        // SAFETY: the buffers belong to this device.
        let needs = |&i: &usize| unsafe { gpu.raw().get_buffer_memory_requirements(self.buffers[i].raw.raw) };
        let needs: Vec<_> = members.iter().map(needs).collect();
        for block in blocks(&needs, gpu.most_bytes.allocation) {
            let memory_block = allocate(gpu, memory, &block)?;
            for &(member, offset) in &block.members {
                let buffer = &mut self.buffers[members[member]];
                // SAFETY: the buffer has no memory yet, and its part of the block has the type, size and alignment that
                // it requires.
                let bound = unsafe { gpu.raw().bind_buffer_memory(buffer.raw.raw, memory_block.raw, offset) };
                gpu.allocated("buffers", block.bytes, bound)?;
            }
            if memory != Memory::Device {
                self.map(gpu, &memory_block, &block, &members)?;
            }
            self.bytes += block.bytes;
            self.blocks.push(memory_block);
        }
        Ok(())
    }

    /// Maps a block to the host for as long as it exists.
    fn map(
        &mut self,
        gpu: &Gpu,
        memory: &Owned<vk::DeviceMemory>,
        block: &Block,
        members: &[usize],
    ) -> Result<(), Error> {
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: the memory is visible to the host and not mapped yet.
        let start = unsafe { gpu.raw().map_memory(memory.raw, 0, vk::WHOLE_SIZE, flags) };
        let start = gpu.allocated("buffers that the host sees", block.bytes, start)?.cast::<u8>();
        for &(member, offset) in &block.members {
            let buffer = &mut self.buffers[members[member]];
            // SAFETY: the buffer's bytes are within the block, and nothing uses them yet.
            unsafe {
                let start = start.add(offset as usize);
                start.write_bytes(0, buffer.bytes as usize);
                buffer.mapped = NonNull::new(start);
            }
        }
        Ok(())
    }

    /// Handle of a buffer.
    pub(crate) fn raw(&self, buffer: usize) -> vk::Buffer {
        self.buffers[buffer].raw.raw
    }

    /// Size of a buffer in bytes.
    pub(crate) fn size(&self, buffer: usize) -> u64 {
        self.buffers[buffer].bytes
    }

    /// The buffers of one kind of memory.
    pub(crate) fn of(&self, memory: Memory) -> impl Iterator<Item = usize> {
        (0..self.buffers.len()).filter(move |&i| self.buffers[i].memory == memory)
    }

    /// The contents of a buffer that is mapped to the host; empty for others.
    ///
    /// # Safety
    /// No work that writes the buffer is under way.
    pub(crate) unsafe fn host(&self, buffer: usize) -> &[u8] {
        let Placed { mapped, bytes, .. } = &self.buffers[buffer];
        // SAFETY: the pointer refers to this many bytes. They were written when they were mapped, and stay mapped as
        // long as the buffer exists. The caller promises that nobody writes them.
        mapped.map_or(&[], |start| unsafe { slice::from_raw_parts(start.as_ptr(), *bytes as usize) })
    }

    /// As [`Buffers::host`], for writing.
    ///
    /// # Safety
    /// No work that uses the buffer is under way.
    pub(crate) unsafe fn host_mut(&mut self, buffer: usize) -> &mut [u8] {
        let Placed { mapped, bytes, .. } = &mut self.buffers[buffer];
        // SAFETY: as in `host`, and the caller promises that nobody reads them.
        mapped.map_or(&mut [], |start| unsafe { slice::from_raw_parts_mut(start.as_ptr(), *bytes as usize) })
    }

    /// The bytes allocated, including the gaps between buffers.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }
}

fn create(gpu: &Arc<Gpu>, wanted: &Buffer) -> Result<Placed, Error> {
    let copied = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
    let usage = match wanted.memory {
        Memory::Device => copied | vk::BufferUsageFlags::STORAGE_BUFFER,
        Memory::Upload | Memory::Download => copied,
    };
    let info = vk::BufferCreateInfo::default().size(wanted.bytes).usage(usage);
    // SAFETY: the device is open, and the program stays within its limits.
    let raw = unsafe { gpu.raw().create_buffer(&info, None) };
    let raw = Owned::new(gpu, gpu.allocated(wanted.name, wanted.bytes, raw)?);
    Ok(Placed { raw, memory: wanted.memory, bytes: wanted.bytes, mapped: None })
}

fn allocate(gpu: &Arc<Gpu>, memory: Memory, block: &Block) -> Result<Owned<vk::DeviceMemory>, Error> {
    let Some(kind) = memory_type(&gpu.memory, memory, block.types) else {
        let reason = format!("it has no memory for buffers of the kind {memory:?}");
        return Err(Error::Device { device: gpu.name().to_owned(), reason });
    };
    let info = vk::MemoryAllocateInfo::default().allocation_size(block.bytes).memory_type_index(kind);
    // SAFETY: the device is open and has this type of memory.
    let raw = unsafe { gpu.raw().allocate_memory(&info, None) };
    Ok(Owned::new(gpu, gpu.allocated("buffers", block.bytes, raw)?))
}

/// One allocation.
#[derive(Debug, PartialEq, Eq)]
struct Block {
    bytes: u64,
    /// The types of memory that all members can use, one bit each.
    types: u32,
    /// Its buffers: index and offset.
    members: Vec<(usize, u64)>,
}

/// Places buffers one after another in blocks of at most this many bytes.
fn blocks(needs: &[vk::MemoryRequirements], most: u64) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for (member, need) in needs.iter().enumerate() {
        let fits = |block: &&mut Block| block.bytes.next_multiple_of(need.alignment) + need.size <= most;
        if let Some(block) = blocks.last_mut().filter(fits) {
            let offset = block.bytes.next_multiple_of(need.alignment);
            block.members.push((member, offset));
            block.bytes = offset + need.size;
            block.types &= need.memory_type_bits;
        } else {
            blocks.push(Block { bytes: need.size, types: need.memory_type_bits, members: vec![(member, 0)] });
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_share_blocks_where_they_fit() {
        let needs = [100, 20, 30, 7].map(|size| vk::MemoryRequirements { size, alignment: 16, memory_type_bits: 5 });
        let block = |bytes, members: &[(usize, u64)]| Block { bytes, types: 5, members: members.to_vec() };
        let all = block(183, &[(0, 0), (1, 112), (2, 144), (3, 176)]);
        assert_eq!(blocks(&needs, 183), [all]);
        let split = [block(132, &[(0, 0), (1, 112)]), block(39, &[(2, 0), (3, 32)])];
        assert_eq!(blocks(&needs, 150), split);
        assert_eq!(blocks(&[], 1), []);
    }
}
