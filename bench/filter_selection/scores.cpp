// SPDX-License-Identifier: BSD-3-Clause
#include "scores.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>

namespace orbis::bench {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

__attribute__((format(printf, 1, 2))) std::string text(const char* pattern, ...) {
  char line[512];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(line, sizeof line, pattern, arguments);
  va_end(arguments);
  return line;
}

template <class F>
double mean_over(const std::vector<case_scores>& cases, F&& value_of) {
  double sum = 0;
  int n = 0;
  for (const case_scores& c : cases) {
    const double v = value_of(c);
    if (!std::isnan(v)) sum += v, ++n;
  }
  return n == 0 ? nan : sum / n;
}

std::string verdict(const char* what, double value, const char* sign, double bound) {
  const bool pass = *sign == '<' ? value <= bound : value >= bound;
  return text("%s  %-78s %8.4f (%s= %g)\n", pass ? "PASS" : "FAIL", what, value, sign, bound);
}

}  // namespace

double outlier_share(const labelled_case& c) {
  return static_cast<double>(std::count(c.labels.begin(), c.labels.end(), label::outlier)) /
         static_cast<double>(c.labels.size());
}

score score_of(const labelled_case& c, const removal& removed) {
  double found = 0, missed = 0, wrong = 0, right = 0, squares = 0, kept = 0;
  for (std::size_t i = 0; i != c.points.size(); ++i) {
    if (c.labels[i] == label::outlier) ++(removed[i] != 0 ? found : missed);
    if (c.labels[i] == label::clean) ++(removed[i] != 0 ? wrong : right);
    if (removed[i] != 0 || !c.distance) continue;
    const double d = c.distance(c.points[i].cast<double>());
    squares += d * d;
    ++kept;
  }
  score s;
  s.f1 = found + missed == 0 ? (wrong == 0 ? 1 : 0) : 2 * found / (2 * found + missed + wrong);
  s.wrong = wrong / std::max(1.0, wrong + right);
  s.missed = missed / std::max(1.0, found + missed);
  s.rms = kept > 0 ? std::sqrt(squares / kept) : nan;
  return s;
}

double score_table::mean_f1(std::size_t setting, trouble kind) const {
  return mean_over(cases, [&](const case_scores& c) { return c.kind == kind ? c.row[setting].f1 : nan; });
}
double score_table::mean_f1(std::size_t setting) const {
  return mean_over(cases, [&](const case_scores& c) { return is_clean(c.kind) ? nan : c.row[setting].f1; });
}
double score_table::mean_wrong(std::size_t setting) const {
  return mean_over(cases, [&](const case_scores& c) { return is_clean(c.kind) ? c.row[setting].wrong : nan; });
}

std::size_t score_table::best_fixed() const {
  std::size_t best = 1;
  for (std::size_t s = 1; s != settings.size(); ++s) {
    if (mean_f1(s) > mean_f1(best)) best = s;
  }
  return best;
}
std::size_t score_table::best_fixed(trouble kind) const {
  std::size_t best = 1;
  for (std::size_t s = 1; s != settings.size(); ++s) {
    if (mean_f1(s, kind) > mean_f1(best, kind)) best = s;
  }
  return best;
}
std::size_t score_table::best_of_case(std::size_t c) const {
  std::size_t best = 1;
  for (std::size_t s = 1; s != settings.size(); ++s) {
    if (cases[c].row[s].f1 > cases[c].row[best].f1) best = s;
  }
  return best;
}

std::string score_table::report() const {
  const std::size_t base = best_fixed();
  std::string out = text("\n%zu cases, %zu fixed settings; best single fixed setting: %s\n\n", cases.size(),
                         settings.size() - 1, settings[base].c_str());
  out += text("%-19s %5s | %-23s | %-23s | %-31s | %s\n", "", "", "F1", "wrongly removed, %", "best for the kind",
              "map RMS, mm (synthetic)");
  out += text("%-19s %5s | %5s %5s %5s %5s | %7s %7s %7s | %5s %-25s | %6s %6s %6s\n", "kind", "cases", "auto", "fixed",
              "kind", "case", "auto", "fixed", "kind", "F1", "setting", "none", "fixed", "auto");
  const auto line = [&](const std::string& name, auto&& belongs, std::size_t best) {
    const auto over = [&](auto&& value) {
      return mean_over(cases, [&](const case_scores& c) { return belongs(c) ? value(c) : nan; });
    };
    const auto count = std::count_if(cases.begin(), cases.end(), belongs);
    const double oracle = over([&](const case_scores& c) {
      if (is_clean(c.kind)) return nan;
      double f1 = 0;
      for (std::size_t s = 1; s != settings.size(); ++s) f1 = std::max(f1, c.row[s].f1);
      return f1;
    });
    const auto f1 = [&](std::size_t s) { return over([&](const case_scores& c) { return c.row[s].f1; }); };
    const auto wrong = [&](std::size_t s) { return 100 * over([&](const case_scores& c) { return c.row[s].wrong; }); };
    const auto rms = [&](std::size_t s) { return 1e3 * over([&](const case_scores& c) { return c.row[s].rms; }); };
    const std::string beside = text(" | %7.3f %7.3f %7.3f | ", wrong(0), wrong(base), wrong(best));
    const std::string map = text(" | %6.1f %6.1f %6.1f\n",
                                 1e3 * over([](const case_scores& c) { return c.untouched.rms; }), rms(base), rms(0));
    out += text("%-19s %5td | ", name.c_str(), count);
    if (std::isnan(oracle)) {  // nothing to find
      out += text("%23s", "") + beside + text("%31s", "") + map;
    } else {
      out += text("%5.3f %5.3f %5.3f %5.3f", f1(0), f1(base), f1(best), oracle) + beside +
             text("%5.3f %-25s", f1(best), settings[best].c_str()) + map;
    }
  };
  for (const bool clean : {false, true}) {
    for (const trouble kind : all_troubles) {
      const auto belongs = [&](const case_scores& c) { return c.kind == kind; };
      if (is_clean(kind) != clean || std::none_of(cases.begin(), cases.end(), belongs)) continue;
      line(std::string{to_string(kind)}, belongs, clean ? base : best_fixed(kind));
    }
    line(
        clean ? "all clean" : "all with outliers", [&](const case_scores& c) { return is_clean(c.kind) == clean; },
        base);
  }

  double worst_single = 0, worst_kind = 0;
  std::string worst_single_name, worst_kind_name;
  double most_wrong = 0;
  for (const case_scores& c : cases) {
    if (is_clean(c.kind)) {
      most_wrong = std::max(most_wrong, c.row[0].wrong);
      continue;
    }
    const double below_single = c.row[base].f1 - c.row[0].f1;
    const double below_kind = c.row[best_fixed(c.kind)].f1 - c.row[0].f1;
    if (below_single > worst_single) worst_single = below_single, worst_single_name = c.name;
    if (below_kind > worst_kind) worst_kind = below_kind, worst_kind_name = c.name;
  }
  out += "\n";
  out += verdict("F1 above the best single fixed setting", mean_f1(0) - mean_f1(base), ">", 0.10);
  out += verdict("wrongly removed from clean clouds, mean, %", 100 * mean_wrong(0), "<", 0.5);
  out += verdict("wrongly removed from the worst clean cloud, %", 100 * most_wrong, "<", 0.5);
  out += verdict(("a case below the best single fixed setting, at most: " + worst_single_name).c_str(), worst_single,
                 "<", 0.10);
  out += verdict(("a case below the best fixed setting for its kind, at most: " + worst_kind_name).c_str(), worst_kind,
                 "<", 0.10);
  for (const trouble kind : {trouble::ghosting, trouble::moving}) {
    if (std::isnan(mean_f1(0, kind))) continue;
    out += verdict((std::string{to_string(kind)} + ": F1 of the automatic choice").c_str(), mean_f1(0, kind), ">", 0.7);
  }
  return out;
}

std::string score_table::csv() const {
  std::string out = "case,kind,setting,f1,wrongly_removed,missed,rms_m\n";
  for (const case_scores& c : cases) {
    for (std::size_t s = 0; s != settings.size(); ++s) {
      out += text("%s,%s,\"%s\",%.5f,%.6f,%.5f,%.6f\n", c.name.c_str(), std::string{to_string(c.kind)}.c_str(),
                  settings[s].c_str(), c.row[s].f1, c.row[s].wrong, c.row[s].missed, c.row[s].rms);
    }
  }
  return out;
}

}  // namespace orbis::bench
