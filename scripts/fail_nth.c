/* Makes the n-th call of one kind fail, in a program that loads this with LD_PRELOAD. scripts/fail-each builds and uses it.
 *
 * BP_FAIL_FOLDER is the folder whose files count; paths that are not absolute count too.
 * BP_FAIL="KIND N ERRNO" makes the N-th call of that kind fail with that error number.
 * BP_FAIL_TRACE, if set, prints the addresses of the callers of the call that fails; addr2line knows their names.
 * BP_FAIL_COUNTS is a file that receives how many calls there were of each kind, a line each.
 *
 * The program renames files without the C library, so strace lets those calls fail. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum kind { OPEN, READ, WRITE, SYNC, REMOVE, MKDIR, LIST, STAT, ALLOCATE, KINDS };
static const char *const NAMES[KINDS] = {"open", "read", "write", "sync", "remove", "mkdir", "list", "stat", "allocate"};

/* Smaller allocations are not counted: no program survives all of them. */
static const size_t LARGE = 64 << 10;

static const char *folder = "";
static enum kind failing = KINDS;
static long failing_at;
static int failing_error;
static int is_traced;
static atomic_long calls[KINDS];
static atomic_char ours[1 << 16]; /* by file descriptor */

__attribute__((constructor)) static void begin(void) {
    const char *asked = getenv("BP_FAIL"), *under = getenv("BP_FAIL_FOLDER");
    char name[16];
    if (under) folder = under;
    if (asked && sscanf(asked, "%15s %ld %d", name, &failing_at, &failing_error) == 3)
        for (int kind = 0; kind < KINDS; kind++)
            if (!strcmp(name, NAMES[kind])) failing = kind;
    ours[STDOUT_FILENO] = 1;
    /* The first call of `backtrace` allocates. */
    void *callers[1];
    is_traced = getenv("BP_FAIL_TRACE") && backtrace(callers, 1);
}

__attribute__((destructor)) static void end(void) {
    const char *counts = getenv("BP_FAIL_COUNTS");
    failing = KINDS;
    FILE *file = counts ? fopen(counts, "w") : NULL;
    if (!file) return;
    for (int kind = 0; kind < KINDS; kind++) fprintf(file, "%s %ld\n", NAMES[kind], atomic_load(&calls[kind]));
    fclose(file);
}

static int fails(enum kind kind) {
    long call = atomic_fetch_add(&calls[kind], 1) + 1;
    if (kind != failing || call != failing_at) return 0;
    if (is_traced) {
        void *callers[64];
        backtrace_symbols_fd(callers, backtrace(callers, 64), STDERR_FILENO);
    }
    errno = failing_error;
    return 1;
}

static int is_ours(const char *path) {
    return path && *path && (*path != '/' || !strncmp(path, folder, strlen(folder)));
}

static int is_open_here(int fd) { return fd >= 0 && fd < (int)sizeof ours && ours[fd]; }

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int opened(int fd, const char *path) {
    if (fd >= 0 && fd < (int)sizeof ours) ours[fd] = is_ours(path);
    return fd;
}

int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    if (is_ours(path) && fails(OPEN)) return -1;
    return opened(REAL(open64)(path, flags, mode), path);
}

ssize_t read(int fd, void *data, size_t bytes) {
    return is_open_here(fd) && fails(READ) ? -1 : REAL(read)(fd, data, bytes);
}

ssize_t write(int fd, const void *data, size_t bytes) {
    return is_open_here(fd) && fails(WRITE) ? -1 : REAL(write)(fd, data, bytes);
}

int fsync(int fd) { return is_open_here(fd) && fails(SYNC) ? -1 : REAL(fsync)(fd); }

int unlink(const char *path) { return is_ours(path) && fails(REMOVE) ? -1 : REAL(unlink)(path); }

int mkdir(const char *path, mode_t mode) { return is_ours(path) && fails(MKDIR) ? -1 : REAL(mkdir)(path, mode); }

DIR *opendir(const char *path) { return is_ours(path) && fails(LIST) ? NULL : REAL(opendir)(path); }

/* Rust asks with no path whether there is such a call at all; the library's declaration says that this never happens, so the
 * compiler would not look. */
typedef int statx_call(int, const char *, int, unsigned, void *);
int asked_statx(int at, const char *path, int flags, unsigned mask, void *about) __asm__("statx");

int asked_statx(int at, const char *path, int flags, unsigned mask, void *about) {
    int counts = path && (*path ? is_ours(path) : is_open_here(at));
    return counts && fails(STAT) ? -1 : ((statx_call *)dlsym(RTLD_NEXT, "statx"))(at, path, flags, mask, about);
}

int fchmod(int fd, mode_t mode) { return is_open_here(fd) && fails(STAT) ? -1 : REAL(fchmod)(fd, mode); }

int flock(int fd, int operation) { return is_open_here(fd) && fails(STAT) ? -1 : REAL(flock)(fd, operation); }

/* glibc's own names: looking for the next ones would allocate. */
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);

void *malloc(size_t bytes) { return bytes >= LARGE && fails(ALLOCATE) ? NULL : __libc_malloc(bytes); }

void *calloc(size_t count, size_t bytes) {
    return (bytes >= LARGE || (bytes && count >= LARGE / bytes)) && fails(ALLOCATE) ? NULL : __libc_calloc(count, bytes);
}

void *realloc(void *memory, size_t bytes) {
    return bytes >= LARGE && fails(ALLOCATE) ? NULL : __libc_realloc(memory, bytes);
}

int posix_memalign(void **memory, size_t alignment, size_t bytes) {
    if (bytes >= LARGE && fails(ALLOCATE)) return ENOMEM;
    *memory = __libc_memalign(alignment, bytes);
    return *memory ? 0 : ENOMEM;
}
