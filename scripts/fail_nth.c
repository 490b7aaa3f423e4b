/* Makes the n-th call of one kind fail, in a program that loads this with LD_PRELOAD. scripts/fail-each builds and uses it.
 *
 * BP_FAIL_FOLDER is the folder whose files count; paths that are not absolute count too.
 * BP_FAIL="KIND N ERRNO" makes the N-th call of that kind fail with that error number. All threads count together.
 * BP_FAIL_MARK is a file that is created when the call fails.
 * BP_FAIL_TRACE, if set, prints the addresses of the callers of the call that fails; addr2line knows their names.
 * BP_FAIL_COUNTS is a file that receives how many calls there were of each kind, a line each.
 *
 * The program renames files without the C library. The kernel sends those calls back to this library as signals (seccomp). */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum kind { OPEN, CREATE, READ, WRITE, SYNC, RENAME, REMOVE, MKDIR, LIST, STAT, ALLOCATE, KINDS };
static const char *const NAMES[KINDS] = {"open", "create", "read", "write", "sync", "rename", "remove", "mkdir", "list", "stat", "allocate"};

/* Smaller allocations are not counted: no program survives all of them. */
static const size_t LARGE = 64 << 10;

static const char *folder = "", *mark;
static enum kind failing = KINDS;
static long failing_at;
static int failing_error;
static int is_traced;
static atomic_long calls[KINDS];
static atomic_char ours[1 << 16]; /* by file descriptor */

static void trap_renames(void);

__attribute__((constructor)) static void begin(void) {
    const char *asked = getenv("BP_FAIL"), *under = getenv("BP_FAIL_FOLDER");
    char name[16];
    if (under) folder = under;
    mark = getenv("BP_FAIL_MARK");
    if (asked && sscanf(asked, "%15s %ld %d", name, &failing_at, &failing_error) == 3)
        for (int kind = 0; kind < KINDS; kind++)
            if (!strcmp(name, NAMES[kind])) failing = kind;
    ours[STDOUT_FILENO] = 1;
    /* The first call of `backtrace` allocates. */
    void *callers[1];
    is_traced = getenv("BP_FAIL_TRACE") && backtrace(callers, 1);
    trap_renames();
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
    /* Without the C library, whose calls are counted and may allocate. */
    if (mark) syscall(SYS_close, syscall(SYS_openat, AT_FDCWD, mark, O_CREAT | O_WRONLY, 0600));
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
    if (is_ours(path) && fails(flags & O_ACCMODE ? CREATE : OPEN)) return -1;
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

#if defined __x86_64__
#define RESULT(context) ((context)->uc_mcontext.gregs[REG_RAX])
#define ARGUMENTS(context) {(context)->uc_mcontext.gregs[REG_RDI], (context)->uc_mcontext.gregs[REG_RSI], \
    (context)->uc_mcontext.gregs[REG_RDX], (context)->uc_mcontext.gregs[REG_R10], (context)->uc_mcontext.gregs[REG_R8]}
#elif defined __aarch64__
#define RESULT(context) ((context)->uc_mcontext.regs[0])
#define ARGUMENTS(context) {(context)->uc_mcontext.regs[0], (context)->uc_mcontext.regs[1], (context)->uc_mcontext.regs[2], \
    (context)->uc_mcontext.regs[3], (context)->uc_mcontext.regs[4]}
#else
#error "this processor's registers are not known here"
#endif

/* The sixth argument of a rename that this library makes itself. The kernel ignores it. */
#define OWN 0x6270666c

/* A rename of the program: it fails, or is made again as one of this library's. */
static void renamed(int signal, siginfo_t *about, void *context) {
    (void)signal;
    long a[] = ARGUMENTS((ucontext_t *)context), result;
    int before = errno;
    /* Only the old call `rename` has no descriptors of folders before its paths. */
    const char *from = (const char *)a[1];
#ifdef SYS_rename
    if (about->si_syscall == SYS_rename) from = (const char *)a[0];
#endif
    result = is_ours(from) && fails(RENAME) ? -1 : syscall(about->si_syscall, a[0], a[1], a[2], a[3], a[4], OWN);
    RESULT((ucontext_t *)context) = result < 0 ? -errno : result;
    errno = before;
}

static void trap_renames(void) {
    struct sigaction action = {.sa_sigaction = renamed, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART};
    struct sock_filter filter[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
#ifdef SYS_rename
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_rename, 3, 0),
#else
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_renameat, 3, 0),
#endif
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_renameat, 2, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_renameat2, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
        /* The lower half: both processors begin with it. */
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, args[5])),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, OWN, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
    };
    struct sock_fprog program = {sizeof filter / sizeof *filter, filter};
    if (sigaction(SIGSYS, &action, NULL) || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program)) {
        perror("fail_nth: cannot catch renames");
        _exit(125);
    }
}
