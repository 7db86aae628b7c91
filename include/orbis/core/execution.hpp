// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Execution policies, the two parallel loops that all parallel algorithms use, and callbacks for progress and
/// cancellation.
///
/// The work is split into chunks whose bounds depend only on the problem, never on the number of threads. An algorithm
/// that writes per element, or combines per-chunk results in chunk order, gives the same bytes under every policy.
#pragma once

#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <type_traits>
#include <vector>

#include <orbis/core/thread_pool.hpp>

namespace orbis {

/// Runs everything on the calling thread.
struct sequential_policy {
  [[nodiscard]] static constexpr unsigned threads() noexcept { return 1; }
};

/// Runs on several threads: one per hardware thread by default, or the number passed to `with`. The threads are started
/// for each loop or come from a pool.
struct parallel_policy {
  unsigned count = 0;           ///< 0: one thread for each hardware thread
  thread_pool* pool = nullptr;  ///< provides the threads; must outlive the policy

  [[nodiscard]] constexpr parallel_policy with(unsigned n) const noexcept { return {n, pool}; }
  /// Uses threads of this pool: all of them unless `with` sets the number.
  [[nodiscard]] constexpr parallel_policy on(thread_pool& threads) const noexcept { return {count, &threads}; }
  [[nodiscard]] unsigned threads() const noexcept {
    if (count == 0 && pool != nullptr) return pool->threads();
    return count != 0 ? count : std::max(1U, std::thread::hardware_concurrency());
  }
};

inline constexpr sequential_policy seq{};
inline constexpr parallel_policy par{};

/// Execution policy: the first argument of a parallel algorithm; specifies the number of threads.
template <class P>
concept execution_policy = requires(const std::remove_cvref_t<P>& p) {
  { p.threads() } -> std::convertible_to<unsigned>;
};

namespace detail {

/// Calls `run(context, i)` for every i in [0, count), on the calling thread and `workers - 1` others. Not a template,
/// to avoid instantiating the thread handling for every loop of a program.
inline void run_on_workers(std::size_t count, std::size_t workers, thread_pool* pool,
                           void (*run)(const void*, std::size_t), const void* context) {
  if (workers <= 1) {
    for (std::size_t i = 0; i != count; ++i) run(context, i);
    return;
  }

  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_guard;
  const auto work = [&] {
    try {
      for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) run(context, i);
    } catch (...) {
      next.store(count, std::memory_order_relaxed);
      const std::lock_guard lock{failure_guard};
      if (!failure) failure = std::current_exception();
    }
  };
  if (pool != nullptr) {
    pool->run(
        workers - 1, [](const void* it) { (*static_cast<const decltype(work)*>(it))(); }, &work);
  } else {
    std::vector<std::jthread> others;
    others.reserve(workers - 1);
    try {
      for (std::size_t i = 1; i != workers; ++i) others.emplace_back(work);
    } catch (const std::system_error&) {
      // The system provides no more threads. The existing threads do all of the work, with the same result.
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace detail

/// Calls `body(begin, end)` on the consecutive chunks `[i * grain, min((i + 1) * grain, count))` of `[0, count)`, on
/// the policy's threads, in no particular order. An exception thrown by `body` stops the distribution of chunks and is
/// rethrown on the calling thread. If the system provides fewer threads than the policy requests, the available threads
/// do all of the work.
/// @pre grain > 0
template <execution_policy Policy, std::invocable<std::size_t, std::size_t> Body>
void for_each_chunk(const Policy& policy, std::size_t count, std::size_t grain, Body&& body) {
  const std::size_t chunks = count / grain + (count % grain != 0 ? 1 : 0);
  const auto run = [&](std::size_t chunk) { body(chunk * grain, std::min(count, (chunk + 1) * grain)); };
  if constexpr (std::is_same_v<Policy, sequential_policy>) {
    for (std::size_t chunk = 0; chunk != chunks; ++chunk) run(chunk);
  } else {
    const auto run_one = [](const void* context, std::size_t chunk) {
      (*static_cast<const decltype(run)*>(context))(chunk);
    };
    thread_pool* pool = nullptr;
    if constexpr (std::is_same_v<Policy, parallel_policy>) pool = policy.pool;
    detail::run_on_workers(chunks, std::min<std::size_t>(policy.threads(), chunks), pool, run_one, &run);
  }
}

/// Calls `body(i)` for every `i` in `[0, count)`.
template <execution_policy Policy, std::invocable<std::size_t> Body>
void for_each_index(const Policy& policy, std::size_t count, std::size_t grain, Body&& body) {
  for_each_chunk(policy, count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) body(i);
  });
}

/// A non-owning reference to a callable `bool(std::size_t done, std::size_t total)`, called periodically by
/// long-running algorithms. It returns true to continue, false to cancel. A default-constructed object refers to no
/// callable.
///
/// The callable must outlive the call it is passed to. Algorithms call it from one thread at a time.
class progress {
 public:
  constexpr progress() noexcept = default;

  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, progress> &&
           std::is_invocable_r_v<
               bool, F&, std::size_t,
               std::size_t>) constexpr progress(F&& callback) noexcept  // NOLINT(google-explicit-constructor):
                                                                        // converts callbacks
      : object_{address_of(callback)}, call_{[](void* object, std::size_t done, std::size_t total) -> bool {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(object))(done, total);
        }} {}

  /// Reports that `done` of `total` is complete; returns false if the caller requested cancellation.
  [[nodiscard]] bool operator()(std::size_t done, std::size_t total) const {
    return call_ == nullptr || call_(object_, done, total);
  }

  [[nodiscard]] explicit operator bool() const noexcept { return call_ != nullptr; }

 private:
  template <class F>
  [[nodiscard]] static constexpr void* address_of(F& callback) noexcept {
    if constexpr (std::is_function_v<F>)
      return reinterpret_cast<void*>(&callback);  // POSIX guarantees the same size
    else
      return const_cast<void*>(static_cast<const void*>(std::addressof(callback)));
  }

  void* object_ = nullptr;
  bool (*call_)(void*, std::size_t, std::size_t) = nullptr;
};

}  // namespace orbis
