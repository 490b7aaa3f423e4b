/* A Vulkan layer that makes the n-th call to an instance or a device fail. scripts/fail-each builds it, and makes the loader use it.
 *
 * BP_FAIL="device N RESULT" makes the N-th call that could lack memory return that VkResult. BP_FAIL="lost N RESULT" makes the N-th
 * call return it that could find the device lost, and every later one on that device. BP_FAIL_MARK is a file that is created when
 * the call fails.
 * BP_FAIL_COUNTS is a file that receives the number of calls of both kinds, a line each. */
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#define EXPORT __attribute__((visibility("default")))

static PFN_vkGetInstanceProcAddr next_instance;
static PFN_vkGetDeviceProcAddr next_device;
static VkInstance instance;
static VkDevice device; /* the last one: the program opens one at a time */
enum kind { DEVICE, LOST, KINDS };
static const char *const NAMES[KINDS] = {"device", "lost"};
static atomic_long calls[KINDS];
static atomic_int lost;
static enum kind failing = KINDS;
static long failing_at;
static VkResult failing_with = VK_SUCCESS;

__attribute__((constructor)) static void begin(void) {
    const char *asked = getenv("BP_FAIL");
    char name[16];
    int result;
    if (!asked || sscanf(asked, "%15s %ld %d", name, &failing_at, &result) != 3) return;
    failing_with = (VkResult)result;
    for (int kind = 0; kind < KINDS; kind++)
        if (!strcmp(name, NAMES[kind])) failing = kind;
}

__attribute__((destructor)) static void end(void) {
    const char *counts = getenv("BP_FAIL_COUNTS");
    FILE *file = counts ? fopen(counts, "w") : NULL;
    if (!file) return;
    for (int kind = 0; kind < KINDS; kind++) fprintf(file, "%s %ld\n", NAMES[kind], atomic_load(&calls[kind]));
    fclose(file);
}

static VkResult failure(enum kind kind) {
    long call = atomic_fetch_add(&calls[kind], 1) + 1;
    if (kind == LOST && atomic_load(&lost)) return failing_with;
    if (kind != failing || call != failing_at) return VK_SUCCESS;
    atomic_store(&lost, kind == LOST);
    const char *mark = getenv("BP_FAIL_MARK");
    FILE *file = mark ? fopen(mark, "w") : NULL;
    if (file) fclose(file);
    return failing_with;
}

/* One function per call: it fails, or calls the next layer. */
#define CALL(name, parameters, arguments)                                        \
    static VKAPI_ATTR VkResult VKAPI_CALL fail_##name parameters {               \
        VkResult result = failure(DEVICE);                                       \
        if (result != VK_SUCCESS) return result;                                 \
        return ((PFN_vk##name)next_device(device, "vk" #name)) arguments;        \
    }

/* The same for a call to an instance. Only while an instance is made does the loader give the next layer's function; later it gives
 * the first layer's. */
#define INSTANCE(name, parameters, arguments)                                    \
    static PFN_vkVoidFunction next_##name;                                       \
    static VKAPI_ATTR VkResult VKAPI_CALL fail_##name parameters {               \
        VkResult result = failure(DEVICE);                                       \
        if (result != VK_SUCCESS) return result;                                 \
        return ((PFN_vk##name)next_##name) arguments;                            \
    }

/* It may find the device lost, but not before it has waited: otherwise work would go on that nobody waits for. */
#define WAIT(name, parameters, arguments)                                        \
    static VKAPI_ATTR VkResult VKAPI_CALL fail_##name parameters {               \
        VkResult result = ((PFN_vk##name)next_device(device, "vk" #name)) arguments; \
        VkResult failed = failure(LOST);                                         \
        return failed != VK_SUCCESS ? failed : result;                           \
    }

/* It finds the device lost before it begins anything. */
#define SUBMIT(name, parameters, arguments)                                      \
    static VKAPI_ATTR VkResult VKAPI_CALL fail_##name parameters {               \
        VkResult result = failure(LOST);                                         \
        if (result != VK_SUCCESS) return result;                                 \
        return ((PFN_vk##name)next_device(device, "vk" #name)) arguments;        \
    }

INSTANCE(EnumeratePhysicalDevices, (VkInstance i, uint32_t *n, VkPhysicalDevice *d), (i, n, d))
INSTANCE(EnumerateDeviceExtensionProperties, (VkPhysicalDevice d, const char *l, uint32_t *n, VkExtensionProperties *p), (d, l, n, p))
INSTANCE(GetPhysicalDeviceImageFormatProperties, (VkPhysicalDevice d, VkFormat f, VkImageType k, VkImageTiling t, VkImageUsageFlags u, VkImageCreateFlags c, VkImageFormatProperties *p), (d, f, k, t, u, c, p))
INSTANCE(GetPhysicalDeviceImageFormatProperties2, (VkPhysicalDevice d, const VkPhysicalDeviceImageFormatInfo2 *i, VkImageFormatProperties2 *p), (d, i, p))
CALL(AllocateMemory, (VkDevice d, const VkMemoryAllocateInfo *i, const VkAllocationCallbacks *a, VkDeviceMemory *m), (d, i, a, m))
CALL(MapMemory, (VkDevice d, VkDeviceMemory m, VkDeviceSize o, VkDeviceSize s, VkMemoryMapFlags f, void **p), (d, m, o, s, f, p))
CALL(CreateBuffer, (VkDevice d, const VkBufferCreateInfo *i, const VkAllocationCallbacks *a, VkBuffer *b), (d, i, a, b))
CALL(BindBufferMemory, (VkDevice d, VkBuffer b, VkDeviceMemory m, VkDeviceSize o), (d, b, m, o))
CALL(CreateShaderModule, (VkDevice d, const VkShaderModuleCreateInfo *i, const VkAllocationCallbacks *a, VkShaderModule *m), (d, i, a, m))
CALL(CreatePipelineCache, (VkDevice d, const VkPipelineCacheCreateInfo *i, const VkAllocationCallbacks *a, VkPipelineCache *c), (d, i, a, c))
CALL(GetPipelineCacheData, (VkDevice d, VkPipelineCache c, size_t *s, void *p), (d, c, s, p))
CALL(CreatePipelineLayout, (VkDevice d, const VkPipelineLayoutCreateInfo *i, const VkAllocationCallbacks *a, VkPipelineLayout *l), (d, i, a, l))
CALL(CreateDescriptorSetLayout, (VkDevice d, const VkDescriptorSetLayoutCreateInfo *i, const VkAllocationCallbacks *a, VkDescriptorSetLayout *l), (d, i, a, l))
CALL(CreateDescriptorPool, (VkDevice d, const VkDescriptorPoolCreateInfo *i, const VkAllocationCallbacks *a, VkDescriptorPool *p), (d, i, a, p))
CALL(AllocateDescriptorSets, (VkDevice d, const VkDescriptorSetAllocateInfo *i, VkDescriptorSet *s), (d, i, s))
CALL(CreateComputePipelines, (VkDevice d, VkPipelineCache c, uint32_t n, const VkComputePipelineCreateInfo *i, const VkAllocationCallbacks *a, VkPipeline *p), (d, c, n, i, a, p))
CALL(CreateCommandPool, (VkDevice d, const VkCommandPoolCreateInfo *i, const VkAllocationCallbacks *a, VkCommandPool *p), (d, i, a, p))
CALL(AllocateCommandBuffers, (VkDevice d, const VkCommandBufferAllocateInfo *i, VkCommandBuffer *b), (d, i, b))
CALL(BeginCommandBuffer, (VkCommandBuffer b, const VkCommandBufferBeginInfo *i), (b, i))
CALL(EndCommandBuffer, (VkCommandBuffer b), (b))
CALL(CreateQueryPool, (VkDevice d, const VkQueryPoolCreateInfo *i, const VkAllocationCallbacks *a, VkQueryPool *p), (d, i, a, p))
WAIT(GetQueryPoolResults, (VkDevice d, VkQueryPool q, uint32_t f, uint32_t n, size_t s, void *p, VkDeviceSize t, VkQueryResultFlags w), (d, q, f, n, s, p, t, w))
CALL(CreateSemaphore, (VkDevice d, const VkSemaphoreCreateInfo *i, const VkAllocationCallbacks *a, VkSemaphore *s), (d, i, a, s))
WAIT(WaitSemaphores, (VkDevice d, const VkSemaphoreWaitInfo *i, uint64_t t), (d, i, t))
CALL(CreateFence, (VkDevice d, const VkFenceCreateInfo *i, const VkAllocationCallbacks *a, VkFence *f), (d, i, a, f))
WAIT(WaitForFences, (VkDevice d, uint32_t n, const VkFence *f, VkBool32 w, uint64_t t), (d, n, f, w, t))
WAIT(GetFenceStatus, (VkDevice d, VkFence f), (d, f))
WAIT(GetSemaphoreCounterValue, (VkDevice d, VkSemaphore s, uint64_t *v), (d, s, v))
WAIT(QueueWaitIdle, (VkQueue q), (q))
WAIT(DeviceWaitIdle, (VkDevice d), (d))
SUBMIT(QueueSubmit, (VkQueue q, uint32_t n, const VkSubmitInfo *s, VkFence f), (q, n, s, f))
CALL(FlushMappedMemoryRanges, (VkDevice d, uint32_t n, const VkMappedMemoryRange *r), (d, n, r))
CALL(InvalidateMappedMemoryRanges, (VkDevice d, uint32_t n, const VkMappedMemoryRange *r), (d, n, r))

#define ENTRY(name) {"vk" #name, (PFN_vkVoidFunction)fail_##name}
static const struct { const char *name; PFN_vkVoidFunction function; } CALLS[] = {
    ENTRY(AllocateMemory), ENTRY(MapMemory), ENTRY(CreateBuffer), ENTRY(BindBufferMemory), ENTRY(CreateShaderModule),
    ENTRY(CreatePipelineCache), ENTRY(GetPipelineCacheData), ENTRY(CreatePipelineLayout), ENTRY(CreateDescriptorSetLayout),
    ENTRY(CreateDescriptorPool), ENTRY(AllocateDescriptorSets), ENTRY(CreateComputePipelines), ENTRY(CreateCommandPool),
    ENTRY(AllocateCommandBuffers), ENTRY(BeginCommandBuffer), ENTRY(EndCommandBuffer), ENTRY(CreateQueryPool),
    ENTRY(GetQueryPoolResults), ENTRY(CreateSemaphore), ENTRY(WaitSemaphores), ENTRY(CreateFence), ENTRY(WaitForFences),
    ENTRY(QueueSubmit), ENTRY(GetFenceStatus), ENTRY(GetSemaphoreCounterValue),
    ENTRY(QueueWaitIdle), ENTRY(DeviceWaitIdle), ENTRY(FlushMappedMemoryRanges), ENTRY(InvalidateMappedMemoryRanges),
};

#define INSTANCE_ENTRY(name) {"vk" #name, (PFN_vkVoidFunction)fail_##name, &next_##name}
static const struct { const char *name; PFN_vkVoidFunction function, *next; } INSTANCE_CALLS[] = {
    INSTANCE_ENTRY(EnumeratePhysicalDevices), INSTANCE_ENTRY(EnumerateDeviceExtensionProperties),
    INSTANCE_ENTRY(GetPhysicalDeviceImageFormatProperties), INSTANCE_ENTRY(GetPhysicalDeviceImageFormatProperties2),
};

#define FOR_EACH(i, calls) for (size_t i = 0; i < sizeof calls / sizeof *calls; i++)

static PFN_vkVoidFunction own_call(const char *name) {
    FOR_EACH(i, CALLS) if (!strcmp(name, CALLS[i].name)) return CALLS[i].function;
    return NULL;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo *info, const VkAllocationCallbacks *callbacks, VkInstance *made) {
    VkResult result = failure(DEVICE);
    if (result != VK_SUCCESS) return result;
    VkLayerInstanceCreateInfo *chain = (VkLayerInstanceCreateInfo *)info->pNext;
    while (chain && !(chain->sType == VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO && chain->function == VK_LAYER_LINK_INFO))
        chain = (VkLayerInstanceCreateInfo *)chain->pNext;
    if (!chain) return VK_ERROR_INITIALIZATION_FAILED;
    next_instance = chain->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    chain->u.pLayerInfo = chain->u.pLayerInfo->pNext;
    result = ((PFN_vkCreateInstance)next_instance(NULL, "vkCreateInstance"))(info, callbacks, made);
    if (result != VK_SUCCESS) return result;
    instance = *made;
    FOR_EACH(i, INSTANCE_CALLS) *INSTANCE_CALLS[i].next = next_instance(instance, INSTANCE_CALLS[i].name);
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo *info, const VkAllocationCallbacks *callbacks, VkDevice *made) {
    VkResult result = failure(DEVICE);
    if (result != VK_SUCCESS) return result;
    /* Another device is not lost. */
    atomic_store(&lost, 0);
    VkLayerDeviceCreateInfo *chain = (VkLayerDeviceCreateInfo *)info->pNext;
    while (chain && !(chain->sType == VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO && chain->function == VK_LAYER_LINK_INFO))
        chain = (VkLayerDeviceCreateInfo *)chain->pNext;
    if (!chain) return VK_ERROR_INITIALIZATION_FAILED;
    next_device = chain->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    PFN_vkGetInstanceProcAddr get = chain->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    chain->u.pLayerInfo = chain->u.pLayerInfo->pNext;
    result = ((PFN_vkCreateDevice)get(instance, "vkCreateDevice"))(physical, info, callbacks, made);
    if (result == VK_SUCCESS) device = *made;
    return result;
}

EXPORT VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL vkGetDeviceProcAddr(VkDevice of, const char *name) {
    if (!strcmp(name, "vkGetDeviceProcAddr")) return (PFN_vkVoidFunction)vkGetDeviceProcAddr;
    PFN_vkVoidFunction next = next_device(of, name), own = own_call(name);
    return own && next ? own : next;
}

EXPORT VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL vkGetInstanceProcAddr(VkInstance of, const char *name) {
    if (!strcmp(name, "vkGetInstanceProcAddr")) return (PFN_vkVoidFunction)vkGetInstanceProcAddr;
    if (!strcmp(name, "vkGetDeviceProcAddr")) return (PFN_vkVoidFunction)vkGetDeviceProcAddr;
    if (!strcmp(name, "vkCreateInstance")) return (PFN_vkVoidFunction)create_instance;
    if (!strcmp(name, "vkCreateDevice")) return (PFN_vkVoidFunction)create_device;
    FOR_EACH(i, INSTANCE_CALLS) if (!strcmp(name, INSTANCE_CALLS[i].name)) return INSTANCE_CALLS[i].function;
    PFN_vkVoidFunction own = own_call(name);
    return own ? own : next_instance(of, name);
}
