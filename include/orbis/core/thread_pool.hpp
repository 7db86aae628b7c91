// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Threads that wait for work, for a parallel_policy: to start one takes as long as many a small loop does.
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

/// Threads that work for one loop at a time, whoever comes first: the loops of others that come meanwhile, and loops
/// inside of loops, run on their callers' threads alone. Owned by the caller, who hands it to policies:
/// @code
///   orbis::thread_pool pool{4};
///   cloud::statistical_filter(orbis::par.on(pool), points);
/// @endcode
/// Any number of threads may use it. Threads look for work for some microseconds before they sleep. A process that is
/// forked has none of them: there a pool made before may be used, on the caller's thread alone, but not destroyed.
class thread_pool {
 public:
  /// `threads`: with the caller's, so that one less is started; 0: as many as the machine has. Where the system gives
  /// fewer there are fewer, and never more than 65536.
  explicit thread_pool(unsigned threads = 0) {
    if (threads == 0) threads = std::thread::hardware_concurrency();
    threads = std::min(threads, static_cast<unsigned>(inside) + 1);
    workers_.reserve(threads);  // where this fails no thread waits yet
    try {
      for (unsigned i = 1; i < threads; ++i) workers_.emplace_back([this] { wait_for_work(); });
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
  }
  thread_pool(const thread_pool&) = delete;
  thread_pool& operator=(const thread_pool&) = delete;
  /// @pre no loop runs on it
  ~thread_pool() {
    state_.fetch_or(stopped);
    state_.notify_all();
  }

  /// The number of threads, with the caller's.
  [[nodiscard]] unsigned threads() const noexcept { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls `work(context)` on the calling thread, and on up to `helpers` others as long as it has not returned there.
  /// Returns when all calls have. @pre `work` does not throw
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
  // The bits of the state: how many helpers are inside of the job, whether others may come, the end, the job's number.
  static constexpr std::uint64_t inside = 0xffff, open = std::uint64_t{1} << 16U, stopped = std::uint64_t{1} << 17U,
                                 one_job = std::uint64_t{1} << 18U;
  static constexpr int patience = 2000;  ///< looks at the state, some 20 us

  void wait_for_work() {
    std::uint64_t done = 0;  // the last job that this thread has looked at
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
  void (*work_)(const void*) = nullptr;  // of the job; these are read by who is inside
  const void* context_ = nullptr;
  std::size_t helpers_ = 0;
  std::vector<std::jthread> workers_;  // the last member: they end before the others go
};

}  // namespace orbis
