/* Calls of the C library that fail on demand, for a process with this file in LD_PRELOAD (Linux).
 *
 * FAILING_CALL="CALL TARGET NUMBER ERRNO MILLISECONDS": the call of this number, from 1, on this target fails with errno,
 * and so does each later one within this time. A write that fails writes half of its bytes before.
 * COUNTED_CALLS=FILE: at the end the file gets a line "CALL TARGET NUMBER" for each call that was seen.
 * Targets: run.csv, run.json, run.json~ (the file that replaces it), folder, stdout, stderr. Other files are not counted.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { CALLS = 4, TARGETS = 6 };
static const char *const calls[CALLS] = {"open", "write", "sync", "rename"};
static const char *const targets[TARGETS] = {"run.csv", "run.json", "run.json~", "folder", "stdout", "stderr"};
static int counts[CALLS][TARGETS];
static int fail_call = -1, fail_target = -1, fail_number, fail_errno, fail_ms;
static long long fails_until_ns;
static const char *counted;

static int index_of(const char *word, const char *const *words, int count) {
  for (int i = 0; i < count; ++i)
    if (strcmp(word, words[i]) == 0) return i;
  return -1;
}

__attribute__((constructor)) static void begin(void) {
  char call[16], target[16];
  const char *given = getenv("FAILING_CALL");
  if (given && sscanf(given, "%15s %15s %d %d %d", call, target, &fail_number, &fail_errno, &fail_ms) == 5) {
    fail_call = index_of(call, calls, CALLS);
    fail_target = index_of(target, targets, TARGETS);
  }
  counted = getenv("COUNTED_CALLS");
}

__attribute__((destructor)) static void end(void) {
  FILE *file = counted ? fopen(counted, "we") : NULL;
  if (!file) return;
  for (int call = 0; call < CALLS; ++call)
    for (int target = 0; target < TARGETS; ++target)
      if (counts[call][target]) fprintf(file, "%s %s %d\n", calls[call], targets[target], counts[call][target]);
  fclose(file);
}

static long long now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000000000LL + now.tv_nsec;
}

/* Return the target of a path, or -1. */
static int target_of(const char *path) {
  const char *slash = strrchr(path, '/');
  const char *name = slash ? slash + 1 : path;
  if (strncmp(name, ".run.json.", 10) == 0) return 2;
  if (strcmp(name, "measured") == 0) return 3; /* the folder of the session */
  int target = index_of(name, targets, 2);
  return target;
}

static int target_of_file(int file) {
  char link[40], path[PATH_MAX];
  if (file == 1) return 4;
  if (file == 2) return 5;
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  ssize_t size = readlink(link, path, sizeof path - 1);
  if (size < 0) return -1;
  path[size] = 0;
  return target_of(path);
}

/* Count a call; return whether it has to fail. */
static int fails(int call, int target) {
  if (target < 0) return 0;
  int number = __sync_add_and_fetch(&counts[call][target], 1);
  if (call != fail_call || target != fail_target) return 0;
  if (number == fail_number) {
    fails_until_ns = now_ns() + fail_ms * 1000000LL;
    return 1;
  }
  return fails_until_ns && now_ns() < fails_until_ns;
}

static int failed(void) {
  errno = fail_errno;
  return -1;
}

#define REAL(type, name) \
  static type real;      \
  if (!real) real = (type)dlsym(RTLD_NEXT, name)

typedef int (*open_function)(const char *, int, ...);
typedef int (*openat_function)(int, const char *, int, ...);
typedef ssize_t (*write_function)(int, const void *, size_t);
typedef int (*sync_function)(int);
typedef int (*rename_function)(const char *, const char *);

#define OPEN(name)                                 \
  int name(const char *path, int flags, ...) {     \
    REAL(open_function, #name);                    \
    va_list rest;                                  \
    va_start(rest, flags);                         \
    int mode = va_arg(rest, int);                  \
    va_end(rest);                                  \
    if (fails(0, target_of(path))) return failed(); \
    return real(path, flags, mode);                \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                          \
  int name(int folder, const char *path, int flags, ...) {    \
    REAL(openat_function, #name);                             \
    va_list rest;                                             \
    va_start(rest, flags);                                    \
    int mode = va_arg(rest, int);                             \
    va_end(rest);                                             \
    if (fails(0, target_of(path))) return failed();           \
    return real(folder, path, flags, mode);                   \
  }
OPENAT(openat)
OPENAT(openat64)

ssize_t write(int file, const void *data, size_t size) {
  REAL(write_function, "write");
  if (fails(1, target_of_file(file))) {
    if (file > 2 && size > 1) real(file, data, size / 2); /* a full disk takes what has room */
    return failed();
  }
  return real(file, data, size);
}

#define SYNC(name)                                        \
  int name(int file) {                                    \
    REAL(sync_function, #name);                           \
    if (fails(2, target_of_file(file))) return failed();  \
    return real(file);                                    \
  }
SYNC(fsync)
SYNC(fdatasync)

int rename(const char *from, const char *to) {
  REAL(rename_function, "rename");
  if (fails(3, target_of(to))) return failed();
  return real(from, to);
}
