// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Persistent threads for a parallel_policy, because starting a thread takes about as long as a small loop.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace orbis {

/// Threads that serve one loop at a time, first come, first served. Nested loops, and loops that start while the pool
/// is busy, run only on the threads of their callers. The caller owns the pool and passes it to policies:
/// @code
///   orbis::thread_pool pool{4};
///   cloud::statistical_filter(orbis::par.on(pool), points);
/// @endcode Any number of threads may use the pool. Its threads poll for work for a few microseconds before they sleep.
/// A fork does not copy the threads: in the child process, a pool created before the fork runs loops on the caller's
/// thread only, and must not be destroyed.
class thread_pool {
 public:
  /// `threads` includes the caller's thread, so one fewer is started; 0 means the number of hardware threads. The pool
  /// has fewer threads if the system provides fewer, and at most 65536.
  explicit thread_pool(unsigned threads = 0) {
    if (threads == 0) threads = std::thread::hardware_concurrency();
    threads = std::min(threads, static_cast<unsigned>(inside) + 1);
    workers_.reserve(threads);  // if this throws, no thread is waiting yet
    try {
      for (unsigned i = 1; i < threads; ++i) workers_.emplace_back([this] { wait_for_work(); });
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
  }
  thread_pool(const thread_pool&) = delete;
  thread_pool& operator=(const thread_pool&) = delete;
  /// @pre no loop is running on the pool
  ~thread_pool() {
    state_.fetch_or(stopped);
    state_.notify_all();
  }

  /// The number of threads, including the caller's.
  [[nodiscard]] unsigned threads() const noexcept { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls `work(context)` on the calling thread and, until that call returns, on up to `helpers` other threads.
  /// Returns when all calls have returned. @pre `work` does not throw
  void run(std::size_t helpers, void (*work)(const void*), const void* context) {
    if (helpers == 0 || workers_.empty() || is_busy_.exchange(true, std::memory_order_acquire)) {
      work(context);
      return;
    }
    work_ = work;
    context_ = context;
    helpers_ = helpers;
    const std::uint64_t next = (state_.load() & ~(open | inside)) + one_job;
    state_.store(next | open);
    state_.notify_all();
    work(context);
    std::uint64_t now = state_.fetch_and(~open) & ~open;
    for (int spins = 0; (now & inside) != 0; now = state_.load()) {
      if (++spins > patience) state_.wait(now);
    }
    is_busy_.store(false, std::memory_order_release);
  }

 private:
  // Bit fields of the state: number of helpers in the current job, job accepts more helpers, pool is stopped, job
  // number.
  static constexpr std::uint64_t inside = 0xffff, open = std::uint64_t{1} << 16U, stopped = std::uint64_t{1} << 17U,
                                 one_job = std::uint64_t{1} << 18U;
  static constexpr int patience = 2000;  ///< number of polls of the state, about 20 us

  void wait_for_work() {
    std::uint64_t done = 0;  // number of the last job that this thread has seen
    int spins = 0;
    for (;;) {
      std::uint64_t now = state_.load();
      if ((now & stopped) != 0) return;
      if ((now & open) == 0 || now / one_job == done) {
        if (spins < patience)
          ++spins;
        else
          state_.wait(now);
        continue;
      }
      if (!state_.compare_exchange_weak(now, now + 1)) continue;
      done = now / one_job;
      spins = 0;
      if ((now & inside) < helpers_) work_(context_);
      now = state_.fetch_sub(1) - 1;
      if ((now & (inside | open)) == 0) state_.notify_all();
    }
  }

  std::atomic<std::uint64_t> state_{0};
  std::atomic<bool> is_busy_{false};
  void (*work_)(const void*) = nullptr;  // function of the current job; read by its threads
  const void* context_ = nullptr;
  std::size_t helpers_ = 0;
  std::vector<std::jthread> workers_;  // the last member: the threads end before the other members are destroyed
};

}  // namespace orbis
