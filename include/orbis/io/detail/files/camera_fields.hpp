// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fields of `camera.toml`.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include <orbis/core/result.hpp>

namespace orbis::io::detail {

/// Reads the fields of a camera table; the first failure is kept.
class camera_fields {
 public:
  camera_fields(const toml::table& table, std::string where) : table_{table}, where_{std::move(where)} {}

  /// The number called `name`; it has to satisfy `ok`, described by `wanted`.
  template <class Ok>
  double number(const char* name, std::optional<double> fallback, const char* wanted, Ok&& ok) {
    const auto node = table_[name];
    if (!node) {
      if (!fallback) reject(name, "is missing");
      return fallback.value_or(1.0);
    }
    const std::optional<double> value = node.value<double>();
    if (!value || !std::isfinite(*value) || !ok(*value)) {
      reject(name, std::string{"must be "} + wanted);
      return 1.0;
    }
    return *value;
  }
  double positive(const char* name, std::optional<double> fallback = std::nullopt) {
    return number(name, fallback, "a number above zero", [](double v) { return v > 0.0 && v < 1e9; });
  }
  int size(const char* name) {
    return static_cast<int>(number(name, std::nullopt, "a whole number from 1 to 100000",
                                   [](double v) { return v >= 1.0 && v <= 1e5 && v == std::floor(v); }));
  }
  std::string text(const char* name) {
    const auto node = table_[name];
    const std::optional<std::string> value = node.value<std::string>();
    if (!node)
      reject(name, "is missing");
    else if (!value)
      reject(name, "must be a string");
    return value.value_or("");
  }
  std::vector<double> numbers(const char* name) {
    std::vector<double> values;
    const auto node = table_[name];
    if (!node) return values;
    const toml::array* list = node.as_array();
    if (list == nullptr) {
      reject(name, "must be a list of numbers");
      return values;
    }
    for (const toml::node& element : *list) {
      const std::optional<double> value = element.value<double>();
      if (!value || !std::isfinite(*value)) reject(name, "must be a list of finite numbers");
      values.push_back(value.value_or(0.0));
    }
    return values;
  }
  /// Rejects a key that is none of `known`: a setting that was meant and misspelt must not get its default.
  void accept_only(std::initializer_list<std::string_view> known) {
    for (const auto& [key, value] : table_) {
      if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
      std::string names;
      for (const std::string_view name : known) names += (names.empty() ? "" : ", ") + std::string{name};
      reject(std::string{key.str()}.c_str(), "is not a setting of a camera; those are " + names);
    }
  }
  void reject(const char* name, const std::string& why) {
    if (!failure_) failure_ = error{errc::malformed, where_, std::string{name} + " " + why};
  }
  [[nodiscard]] const std::optional<error>& failure() const { return failure_; }

 private:
  const toml::table& table_;
  std::string where_;
  std::optional<error> failure_;
};

}  // namespace orbis::io::detail
