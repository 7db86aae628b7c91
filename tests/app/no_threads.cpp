// SPDX-License-Identifier: BSD-3-Clause
//
// Loaded before a program (LD_PRELOAD): it gets one thread beside its first, which rgbd_slam waits for signals on, and
// no more.
#include <atomic>
#include <cerrno>

#include <dlfcn.h>
#include <pthread.h>

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                              void* argument) {
  static std::atomic<bool> given{false};
  if (given.exchange(true)) return EAGAIN;
  using create = int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  return reinterpret_cast<create*>(dlsym(RTLD_NEXT, "pthread_create"))(thread, attributes, run, argument);
}
