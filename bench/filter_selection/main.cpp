// SPDX-License-Identifier: BSD-3-Clause
//
// How well the automatic choice of a filter does, against every fixed setting.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <orbis/cloud/select.hpp>
#include <orbis/cloud/select_by_views-inl.hpp>

#include "../../examples/common/filter_text.hpp"
#include "heat_map.hpp"
#include "scores.hpp"
#include "settings.hpp"

namespace {

using namespace orbis::bench;

constexpr const char* usage =
    "filter_selection [--set tuning|judging] [--data DIR] [--csv FILE] [--png FILE] [--cases]\n"
    "  --set    which cases: tuning (default) or judging; they share no room, sensor, seed or recording\n"
    "  --data   folder of real recordings; default: ORBIS_DATA_DIR\n"
    "  --csv    one row for each case and setting\n"
    "  --png    picture: kinds of case by settings, F1\n"
    "  --cases  a line for each case, with the automatic choice and its reason\n";

struct settings_of_run {
  std::string set = "tuning";
  std::filesystem::path data, csv, png;
  bool cases = false;
};

std::optional<settings_of_run> parse(int argc, char** argv) {
  settings_of_run s;
  const char* environment = std::getenv("ORBIS_DATA_DIR");
  s.data = environment != nullptr ? environment : ORBIS_DATA_DIR;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--cases") {
      s.cases = true;
      continue;
    }
    if (i + 1 == argc) return std::nullopt;
    const std::string value = argv[++i];
    if (option == "--set" && (value == "tuning" || value == "judging"))
      s.set = value;
    else if (option == "--data")
      s.data = value;
    else if (option == "--csv")
      s.csv = value;
    else if (option == "--png")
      s.png = value;
    else
      return std::nullopt;
  }
  return s;
}

struct automatic_run {
  removal removed;
  orbis::cloud::filter_choice choice;
};

automatic_run run_automatic(const labelled_case& c) {
  orbis::cloud::select_options options;
  options.ranges = c.ranges;
  auto result = c.views.empty() ? orbis::cloud::filter_automatically(orbis::par, c.points, options)
                                : orbis::cloud::filter_automatically(orbis::par, c.points, c.views, c.camera, options);
  removal removed(c.points.size(), 1);
  for (const std::uint32_t i : result.inliers) removed[i] = 0;
  return {std::move(removed), std::move(result.choice)};
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) {
    std::fputs(usage, argc == 2 && std::string{argv[1]} == "--help" ? stdout : stderr);
    return argc == 2 && std::string{argv[1]} == "--help" ? 0 : 2;
  }
  const auto fixed = fixed_settings();
  score_table table;
  table.settings.push_back("automatic");
  for (const setting& s : fixed) table.settings.push_back(s.name);
  for (const surface& surface : surfaces_of(options->set, options->data)) {
    for (const trouble kind : all_troubles) {
      if (!applies(kind, surface)) continue;
      const labelled_case c = make_case(surface, kind);
      if (!is_clean(kind) && outlier_share(c) < 0.0005) continue;  // nobody came into view, say
      const neighborhoods n{c};
      std::vector<score> row;
      const automatic_run automatic = run_automatic(c);
      row.push_back(score_of(c, automatic.removed));
      for (const setting& s : fixed) row.push_back(score_of(c, s.apply(n)));
      table.cases.push_back({c.name(), kind, std::move(row), score_of(c, removal(c.points.size()))});
      if (options->cases) {
        const case_scores& last = table.cases.back();
        const std::size_t best = table.best_of_case(table.cases.size() - 1);
        std::printf("%-34s %6zu points, %5.1f %% bad | F1 %.3f wrong %.4f | best %.3f %s | %s\n", c.name().c_str(),
                    c.points.size(), 100 * outlier_share(c), last.row[0].f1, last.row[0].wrong, last.row[best].f1,
                    table.settings[best].c_str(),
                    (to_string(automatic.choice.chain) + ": " + examples::filter_text(automatic.choice)).c_str());
        std::fflush(stdout);
      }
    }
  }
  if (table.cases.empty()) {
    std::fputs("no cases\n", stderr);
    return 1;
  }
  std::fputs(table.report().c_str(), stdout);
  if (!options->csv.empty()) std::ofstream{options->csv} << table.csv();
  if (!options->png.empty() && !write_heat_map(table, options->png)) {
    std::fprintf(stderr, "cannot write %s\n", options->png.string().c_str());
    return 1;
  }
  return 0;
}
