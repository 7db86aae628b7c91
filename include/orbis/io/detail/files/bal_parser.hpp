// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Parser of the text format of "Bundle Adjustment in the Large".
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/bal_problem.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// Reads the file number by number, and counts lines for error messages.
class bal_parser {
 public:
  bal_parser(std::string_view text, const std::filesystem::path& where)
      : where_{where}, at_{text.data()}, end_{text.data() + text.size()} {}

  [[nodiscard]] result<bal_problem> parse() {
    bal_problem problem;
    if (read_header(problem) && read_observations(problem) && read_parameters(problem) && ends()) return problem;
    return fail(code_, at_line(where_, line_), std::move(problem_));
  }

 private:
  bool reject(std::string why, errc code = errc::malformed) {
    problem_ = std::move(why);
    code_ = code;
    return false;
  }
  void skip_blanks() {
    for (; at_ != end_ && is_blank(*at_); ++at_) line_ += *at_ == '\n' ? 1 : 0;
  }
  [[nodiscard]] std::string field_in_quotes() const { return in_quotes({at_, std::find_if(at_, end_, is_blank)}); }

  /// Reads the next number. `what` and `of`: kind and index of the object that the number belongs to, for errors.
  template <class T>
  bool read(T& value, const char* what, std::size_t of) {
    skip_blanks();
    const auto named = [&] { return std::string{what} + " " + std::to_string(of); };
    if (at_ == end_) return reject("the file ends early: " + named() + " is incomplete");
    const char* first = at_;
    if (*first == '+' && end_ - first > 1 && first[1] != '-') ++first;
    const auto [last, failure] = std::from_chars(first, end_, value);
    if (failure != std::errc{} || (last != end_ && !is_blank(*last)))
      return reject(named() + " has " + field_in_quotes() +
                    (std::is_integral_v<T> ? ", which is not an index" : ", which is not a number"));
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) return reject(named() + " has " + field_in_quotes() + ", which is not finite");
    at_ = last;
    return true;
  }

  bool read_header(bal_problem& problem) {
    const std::string_view text{at_, static_cast<std::size_t>(end_ - at_)};
    if (text.starts_with("BZh") || text.starts_with("\x1f\x8b"))
      return reject("is compressed; unpack it first", errc::unsupported);
    if (text.starts_with("\xEF\xBB\xBF")) at_ += 3;
    std::uint64_t counts[3];
    for (std::uint64_t& count : counts) {
      skip_blanks();
      const auto [last, failure] = std::from_chars(at_, end_, count);
      if (failure != std::errc{} || (last != end_ && !is_blank(*last)))
        return reject("the file must begin with the numbers of cameras, points and observations" +
                      (at_ == end_ ? std::string{} : ", not with " + field_in_quotes()));
      at_ = last;
    }
    // A number takes at least a blank and a digit, so the rest of the file limits the allocation.
    const auto fitting = static_cast<std::uint64_t>(end_ - at_) / 2;
    const auto [cameras, points, observations] = counts;
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    if (cameras > fitting / 9 || points > fitting / 3 || observations > fitting / 4 ||
        9 * cameras + 3 * points + 4 * observations > fitting || cameras > most || points > most)
      return reject("the file is too short for " + std::to_string(cameras) + " cameras, " + std::to_string(points) +
                    " points and " + std::to_string(observations) + " observations");
    problem.cameras.resize(static_cast<std::size_t>(cameras));
    problem.points.resize(static_cast<std::size_t>(points), zeros<vec3>());
    problem.observations.resize(static_cast<std::size_t>(observations));
    return true;
  }

  bool read_observations(bal_problem& problem) {
    for (std::size_t k = 0; k != problem.observations.size(); ++k) {
      bal_observation& o = problem.observations[k];
      if (!read(o.camera, "observation", k)) return false;
      if (o.camera >= problem.cameras.size())
        return reject("observation " + std::to_string(k) + " refers to the nonexistent camera " +
                      std::to_string(o.camera));
      if (!read(o.point, "observation", k)) return false;
      if (o.point >= problem.points.size())
        return reject("observation " + std::to_string(k) + " refers to the nonexistent point " +
                      std::to_string(o.point));
      if (!read(o.pixel.x(), "observation", k) || !read(o.pixel.y(), "observation", k)) return false;
    }
    return true;
  }

  bool read_parameters(bal_problem& problem) {
    for (std::size_t i = 0; i != problem.cameras.size(); ++i)
      for (double& value : problem.cameras[i])
        if (!read(value, "camera", i)) return false;
    for (std::size_t j = 0; j != problem.points.size(); ++j)
      for (int c = 0; c != 3; ++c)
        if (!read(problem.points[j][c], "point", j)) return false;
    return true;
  }

  bool ends() {
    skip_blanks();
    return at_ == end_ || reject("the file continues after the last point: " + field_in_quotes());
  }

  const std::filesystem::path& where_;
  const char* at_;
  const char* end_;
  std::size_t line_ = 1;
  std::string problem_;
  errc code_ = errc::malformed;
};

}  // namespace orbis::io::detail
