/* SPDX-License-Identifier: MIT */
/* rlimits and a seccomp filter that denies by default. */
#include "server/decoder/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

enum { OPEN_FILES = 16 };

/* Computing, and using what is open. */
static const int allowed[] = {
    SCMP_SYS(read),          SCMP_SYS(write),           SCMP_SYS(readv),
    SCMP_SYS(writev),        SCMP_SYS(pread64),         SCMP_SYS(pwrite64),
    SCMP_SYS(preadv),        SCMP_SYS(pwritev),         SCMP_SYS(lseek),
    SCMP_SYS(close),         SCMP_SYS(fstat),           SCMP_SYS(ftruncate),
    SCMP_SYS(fallocate),     SCMP_SYS(sync_file_range), SCMP_SYS(fcntl),
    SCMP_SYS(poll),          SCMP_SYS(ppoll),           SCMP_SYS(recvmsg),
    SCMP_SYS(sendmsg),       SCMP_SYS(recvfrom),        SCMP_SYS(sendto),
    SCMP_SYS(brk),           SCMP_SYS(munmap),          SCMP_SYS(mremap),
    SCMP_SYS(madvise),       SCMP_SYS(futex),           SCMP_SYS(exit),
    SCMP_SYS(exit_group),    SCMP_SYS(rt_sigaction),    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),  SCMP_SYS(sigaltstack),     SCMP_SYS(restart_syscall),
    SCMP_SYS(clock_gettime), SCMP_SYS(clock_getres),    SCMP_SYS(clock_nanosleep),
    SCMP_SYS(nanosleep),     SCMP_SYS(gettimeofday),    SCMP_SYS(time),
    SCMP_SYS(getrandom),     SCMP_SYS(sched_yield),     SCMP_SYS(sched_getaffinity),
    SCMP_SYS(getpid),        SCMP_SYS(gettid),          SCMP_SYS(getuid),
    SCMP_SYS(geteuid),       SCMP_SYS(getgid),          SCMP_SYS(getegid),
    SCMP_SYS(getrusage),     SCMP_SYS(times),           SCMP_SYS(sysinfo),
    SCMP_SYS(uname),         SCMP_SYS(membarrier),      SCMP_SYS(set_robust_list),
    SCMP_SYS(rseq),          SCMP_SYS(getcpu),
};

/* No decoder has an honest use for these. */
static const int deadly[] = {
    SCMP_SYS(execve),
    SCMP_SYS(execveat),
    SCMP_SYS(fork),
    SCMP_SYS(vfork),
    SCMP_SYS(ptrace),
    SCMP_SYS(socket),
    SCMP_SYS(socketpair),
    SCMP_SYS(connect),
    SCMP_SYS(bind),
    SCMP_SYS(listen),
    SCMP_SYS(accept),
    SCMP_SYS(accept4),
    SCMP_SYS(process_vm_readv),
    SCMP_SYS(process_vm_writev),
    SCMP_SYS(bpf),
    SCMP_SYS(perf_event_open),
    SCMP_SYS(io_uring_setup),
    SCMP_SYS(keyctl),
    SCMP_SYS(mount),
    SCMP_SYS(umount2),
    SCMP_SYS(pivot_root),
    SCMP_SYS(chroot),
    SCMP_SYS(setns),
    SCMP_SYS(unshare),
    SCMP_SYS(init_module),
    SCMP_SYS(finit_module),
    SCMP_SYS(kexec_load),
    SCMP_SYS(reboot),
    SCMP_SYS(swapon),
    SCMP_SYS(userfaultfd),
    SCMP_SYS(kill),
    SCMP_SYS(tkill),
    SCMP_SYS(open_by_handle_at),
};

/* Calls that are harmless with some arguments only. */
static int add_conditional(scmp_filter_ctx filter)
{
    int failure = 0;
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1,
                                SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1,
                                SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    /* Allows threads, but no processes. clone3 hides its flags in memory, so glibc has to fall
     * back. */
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(clone), 1,
                                SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD));
    failure |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    /* abort() signals its own thread. The last zeros are for comparisons that take two numbers. */
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1,
                                SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)getpid(), 0));
    /* fstat of glibc is newfstatat with an empty path. */
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(newfstatat), 1,
                                SCMP_A3(SCMP_CMP_EQ, AT_EMPTY_PATH, 0));
    /* Limits may be read, not raised. */
    failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 1,
                                SCMP_A2(SCMP_CMP_EQ, 0, 0));
    return failure;
}

static bool load_filter(struct error *err)
{
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    int failure = filter ? 0 : -ENOMEM;
    if (filter) {
        failure |= seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
        for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; i++)
            failure |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
        for (size_t i = 0; i < sizeof deadly / sizeof deadly[0]; i++)
            failure |= seccomp_rule_add(filter, SCMP_ACT_KILL_PROCESS, deadly[i], 0);
        failure |= add_conditional(filter);
        if (failure == 0)
            failure = seccomp_load(filter);
        seccomp_release(filter);
    }
    return failure == 0 ||
           error_set(err, ERROR_INTERNAL, "sandbox: the system call filter is refused: %s",
                     strerror(failure < 0 ? -failure : failure));
}

static bool limit(int resource, uint64_t value, const char *name, struct error *err)
{
    struct rlimit both = {value, value};
    return setrlimit((__rlimit_resource_t)resource, &both) == 0 ||
           error_set(err, ERROR_INTERNAL, "sandbox: limit of %s: %s", name, strerror(errno));
}

/* Address space in use, from /proc. */
static uint64_t mapped_bytes(void)
{
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "re");
    if (file) {
        if (fscanf(file, "%llu", &pages) != 1)
            pages = 0;
        fclose(file);
    }
    return pages * (uint64_t)sysconf(_SC_PAGESIZE);
}

static bool limit_memory(uint64_t memory_bytes, struct error *err)
{
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
    (void)memory_bytes, (void)err; /* sanitizers map terabytes of shadow */
    (void)mapped_bytes;
    return true;
#else
    return memory_bytes == 0 || limit(RLIMIT_AS, mapped_bytes() + memory_bytes, "memory", err);
#endif
}

bool sandbox_enter(const struct sandbox_desc *desc, struct error *err)
{
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) != 0)
        return error_set(err, ERROR_INTERNAL, "sandbox: %s", strerror(errno));
    return limit(RLIMIT_CORE, 0, "core files", err) &&
           limit(RLIMIT_FSIZE, desc->file_bytes, "file size", err) &&
           limit(RLIMIT_NOFILE, OPEN_FILES, "open files", err) &&
           limit(RLIMIT_CPU, (uint64_t)desc->cpu_s, "processor time", err) &&
           limit_memory(desc->memory_bytes, err) && load_filter(err);
}
