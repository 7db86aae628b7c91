// SPDX-License-Identifier: BSD-3-Clause
//
// The benchmark harness. Rows are named `group/parameters/who`; rows that differ in `who` alone are
// the same work done by us and by a peer in the same run, and are printed side by side with their
// ratio. Repetitions of all rows are interleaved, so that a busy moment of the machine hits both.
// Everything Google Benchmark offers works as usual, e.g. --benchmark_filter=octree.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 != 0 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Why a run did not measure anything; empty if it did. Google Benchmark 1.8 has renamed the members.
template <class Run>
std::string reason_for_skipping(const Run& run) {
  if constexpr (requires { run.error_occurred; }) {
    return run.error_occurred ? "failed: " + run.error_message : std::string{};
  } else {
    return static_cast<int>(run.skipped) != 0 ? "skipped: " + run.skip_message : std::string{};
  }
}

/// Collects the repetitions of every row and prints medians and ratios when all have run.
class ratio_table final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&std::cerr, context);
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      std::string name = run.run_name.function_name;
      if (!run.run_name.args.empty()) name += "/" + run.run_name.args;
      if (const std::string why = reason_for_skipping(run); !why.empty()) {
        std::fprintf(stderr, "%s: %s\n", name.c_str(), why.c_str());
        failed_ = true;
        continue;
      }
      const double seconds =
          run.real_accumulated_time / static_cast<double>(std::max<benchmark::IterationCount>(1, run.iterations));
      row& r = row_named(name);
      r.seconds.push_back(seconds);
      for (const auto& [counter, value] : run.counters)
        if (counter != "items_per_second") r.counters[counter].push_back(value.value);
      std::fprintf(stderr, "  %-60s %12.4f ms\n", name.c_str(), 1e3 * seconds);
    }
  }

  void Finalize() override {
    std::printf("\n%-64s %12s %10s\n", "median of the repetitions", "ms", "peer/orbis");
    // Interleaving hands the rows out in any order.
    std::stable_sort(rows_.begin(), rows_.end(), [](const row& a, const row& b) {
      return std::tuple(a.group, !a.is_orbis(), a.who) < std::tuple(b.group, !b.is_orbis(), b.who);
    });
    std::string previous_group;
    for (const row& r : rows_) {
      if (r.group != previous_group) std::printf("%s\n", r.group.c_str());
      previous_group = r.group;
      const double ms = 1e3 * median(r.seconds);
      std::printf("    %-60s %12.4f", r.who.c_str(), ms);
      if (const row* ours = our_row(r.group); ours != nullptr && !r.is_orbis()) {
        std::printf(" %10.2f", ms / (1e3 * median(ours->seconds)));
      } else if (const row* peer = only_peer(r.group); peer != nullptr && r.is_orbis() && r.who != "orbis") {
        std::printf(" %10.2f", 1e3 * median(peer->seconds) / ms);  // a second way of ours
      } else if (!r.counters.empty()) {
        std::printf(" %10s", "");
      }
      for (const auto& [counter, values] : r.counters) std::printf("  %s %.4g", counter.c_str(), median(values));
      std::printf("\n");
    }
  }

  /// Whether there are rows, and all of them were measured.
  [[nodiscard]] bool complete() const { return !rows_.empty() && !failed_; }

 private:
  struct row {
    std::string group;
    std::string who;
    std::vector<double> seconds;
    std::map<std::string, std::vector<double>> counters;
    [[nodiscard]] bool is_orbis() const { return who.starts_with("orbis"); }
  };

  row& row_named(const std::string& name) {
    const auto slash = name.rfind('/');
    std::string group = slash == std::string::npos ? name : name.substr(0, slash);
    std::string who = slash == std::string::npos ? "orbis" : name.substr(slash + 1);
    for (row& r : rows_) {
      if (r.group == group && r.who == who) return r;
    }
    return rows_.emplace_back(row{std::move(group), std::move(who), {}, {}});
  }

  [[nodiscard]] const row* our_row(const std::string& group) const {
    const auto found =
        std::find_if(rows_.begin(), rows_.end(), [&](const row& r) { return r.group == group && r.who == "orbis"; });
    return found == rows_.end() ? nullptr : &*found;
  }

  /// The row of somebody else, if there is just one in the group.
  [[nodiscard]] const row* only_peer(const std::string& group) const {
    const row* peer = nullptr;
    for (const row& r : rows_) {
      if (r.group != group || r.is_orbis()) continue;
      if (peer != nullptr) return nullptr;
      peer = &r;
    }
    return peer;
  }

  std::vector<row> rows_;
  bool failed_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  std::string repetitions = "--benchmark_repetitions=3";
  std::string interleaved = "--benchmark_enable_random_interleaving=true";
  std::string minimum = "--benchmark_min_time=0.2";
  // Defaults first, so that what the user says overrides them.
  arguments.insert(arguments.begin() + 1, {repetitions.data(), interleaved.data(), minimum.data()});
  const bool listing = std::any_of(arguments.begin(), arguments.end(), [](const char* argument) {
    return std::string_view{argument}.starts_with("--benchmark_list_tests");
  });
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 1;
  ratio_table table;
  benchmark::RunSpecifiedBenchmarks(&table);
  benchmark::Shutdown();
  if (listing) return 0;
  return table.complete() ? 0 : 1;
}
