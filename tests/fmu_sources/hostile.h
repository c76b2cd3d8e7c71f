/* What an FMU may do to the process that runs it; `fault` 100 and above in lag2.c, in the order of build.HOSTILE. */
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <setjmp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>

static void write_all(int last) {
    char garbage[200];
    memset(garbage, 0xA5, sizeof garbage);
    for (int fd = 3; fd <= last; fd++) {
        struct stat s;
        if (fstat(fd, &s) == 0 && S_ISFIFO(s.st_mode) && write(fd, garbage, sizeof garbage) < 0) continue;
    }
}
static void close_all(int last) {
    for (int fd = 3; fd <= last; fd++) close(fd);
}
static void steal(int last) {
    char taken[4096];
    for (int fd = 3; fd <= last; fd++) {
        struct stat s;
        if (fstat(fd, &s) || !S_ISFIFO(s.st_mode)) continue;
        fcntl(fd, F_SETFL, O_NONBLOCK);
        if (read(fd, taken, sizeof taken) < 0) continue;
    }
}
static void* crash_later(void* unused) { (void)unused; usleep(300000); *nowhere = 1; return NULL; }
static void* exit_later(void* unused) { (void)unused; usleep(300000); exit(7); }
static void* burn(void* unused) { (void)unused; hang(); return NULL; }
static void start_thread(void* (*f)(void*)) {
    pthread_t t;
    pthread_create(&t, NULL, f, NULL);
    pthread_detach(t);
}
static void remove_below(const char* path) {
    DIR* d = opendir(path);
    struct dirent* e;
    char name[4096];
    if (!d) return;
    while ((e = readdir(d))) {
        if (!strcmp(e->d_name, ".") || !strcmp(e->d_name, "..")) continue;
        snprintf(name, sizeof name, "%s/%s", path, e->d_name);
        struct stat s;
        if (lstat(name, &s) == 0 && S_ISDIR(s.st_mode)) remove_below(name), rmdir(name);
        else unlink(name);
    }
    closedir(d);
}
static const char* own_library(void) {
    static Dl_info info;
    return dladdr((void*)own_library, &info) ? info.dli_fname : "";
}
static volatile int deep(volatile int n) { volatile char room[4096]; room[0] = (char)n; return deep(n + 1) + room[0]; }
static void ignore_it(int n) { (void)n; }
static void die_at_exit(void) { abort(); }
static void daemonise(void) {
    if (fork() == 0) {
        setsid();
        if (fork() == 0) for (;;) sleep(60);
        _exit(0);
    }
}

static void hostile(int what) {
    static int done; /* once per process is enough for what would only repeat itself at each step */
    int first = !done++;
    switch (what) {
        case 0: write_all(31); break;
        case 1: write_all(1023); break;
        case 2: close_all(31); break;
        case 3: close_all(1023); break;
        case 4: if (first && fork() < 0) break; break;
        case 5: if (first && fork() == 0) hang(); break;
        case 6: if (first) daemonise(); break;
        case 7: if (first) start_thread(crash_later); break;
        case 8: if (first) start_thread(exit_later); break;
        case 9: fesetround(FE_UPWARD); break;
        case 10: feenableexcept(FE_ALL_EXCEPT); break;
        case 11: setenv("LC_ALL", "de_DE", 1), setenv("HOME", "/nowhere", 1), unsetenv("PATH"); break;
        case 12: clearenv(); break;
        case 13: if (chdir("/")) return; break;
        case 14: { char cwd[4096]; if (getcwd(cwd, sizeof cwd)) rmdir(cwd); break; }
        case 15: umask(0777); break;
        case 16: setlocale(LC_ALL, "C.UTF-8"); break;
        case 17: signal(SIGSEGV, ignore_it), signal(SIGTERM, SIG_IGN); break;
        case 18: { struct itimerval t = {{0, 0}, {0, 200000}}; setitimer(ITIMER_REAL, &t, NULL); break; }
        case 19: close(0), close(1), close(2); break;
        case 20: { int fd = open("/dev/null", O_WRONLY); dup2(fd, 1), dup2(fd, 2), close(fd); break; }
        case 21: if (first) for (int i = 0; i < 1000000; i++) printf("a very talkative model of some length .............\n"); break;
        case 22: raise(SIGKILL); break;
        case 23: raise(SIGSTOP); break;
        case 24: if (first) kill(getppid(), SIGKILL); break;
        case 25: unlink(own_library()); break;
        case 26: { int fd = open(own_library(), O_WRONLY | O_TRUNC); if (fd >= 0) close(fd); break; }
        case 27: remove_below(".."); break;
        case 28: exit(0);
        case 29: _exit(1);
        case 30: sink += deep(0); break;
        case 31: raise(SIGFPE); break;
        case 32: __builtin_trap();
        case 33: pthread_exit(NULL);
        case 34: for (;;) sleep(1000);
        case 35: if (!malloc((size_t)30 << 30)) sink += 1.0; break;
        case 36: { sigset_t all; sigfillset(&all); sigprocmask(SIG_SETMASK, &all, NULL); break; }
        case 37: { struct rlimit few = {5, 5}; setrlimit(RLIMIT_NOFILE, &few); break; }
        case 38: kill(0, SIGTERM); break;
        case 39: steal(1023); break;
        case 40: atexit(die_at_exit); break;
        case 41: for (int i = 0; i < 50; i++) if (open("/dev/null", O_RDONLY) < 0) break; break;
        case 42: if (first) start_thread(burn); break;
        default: break;
    }
}
