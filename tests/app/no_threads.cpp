// SPDX-License-Identifier: BSD-3-Clause
//
// Loaded before a program (LD_PRELOAD): at a time it has at most as many threads beside its first as MOST_THREADS says,
// otherwise one, on which rgbd_slam waits for signals.
#include <atomic>
#include <cerrno>
#include <cstdlib>

#include <dlfcn.h>
#include <pthread.h>

namespace {

std::atomic<int> running{0};

struct task {
  void* (*run)(void*);
  void* argument;
};

void* run_task(void* of) {
  const task t = *static_cast<task*>(of);
  delete static_cast<task*>(of);
  void* const result = t.run(t.argument);
  --running;
  return result;
}

}  // namespace

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                              void* argument) {
  const char* const most = std::getenv("MOST_THREADS");
  if (++running > (most != nullptr ? std::atoi(most) : 1)) {
    --running;
    return EAGAIN;
  }
  using create = int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  return reinterpret_cast<create*>(dlsym(RTLD_NEXT, "pthread_create"))(thread, attributes, run_task,
                                                                       new task{run, argument});
}
