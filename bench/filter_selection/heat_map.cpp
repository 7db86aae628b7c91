// SPDX-License-Identifier: BSD-3-Clause
#include "heat_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/io/png.hpp>

namespace orbis::bench {

namespace {

/// Five columns of seven pixels for each character from ' ' to '~', the lowest bit on top; capitals stand for small
/// letters too.
struct glyph {
  char character;
  std::array<std::uint8_t, 5> columns;
};
constexpr std::array glyphs{glyph{'0', {0x3e, 0x51, 0x49, 0x45, 0x3e}}, glyph{'1', {0x00, 0x42, 0x7f, 0x40, 0x00}},
                            glyph{'2', {0x42, 0x61, 0x51, 0x49, 0x46}}, glyph{'3', {0x21, 0x41, 0x45, 0x4b, 0x31}},
                            glyph{'4', {0x18, 0x14, 0x12, 0x7f, 0x10}}, glyph{'5', {0x27, 0x45, 0x45, 0x45, 0x39}},
                            glyph{'6', {0x3c, 0x4a, 0x49, 0x49, 0x30}}, glyph{'7', {0x01, 0x71, 0x09, 0x05, 0x03}},
                            glyph{'8', {0x36, 0x49, 0x49, 0x49, 0x36}}, glyph{'9', {0x06, 0x49, 0x49, 0x29, 0x1e}},
                            glyph{'A', {0x7e, 0x11, 0x11, 0x11, 0x7e}}, glyph{'B', {0x7f, 0x49, 0x49, 0x49, 0x36}},
                            glyph{'C', {0x3e, 0x41, 0x41, 0x41, 0x22}}, glyph{'D', {0x7f, 0x41, 0x41, 0x22, 0x1c}},
                            glyph{'E', {0x7f, 0x49, 0x49, 0x49, 0x41}}, glyph{'F', {0x7f, 0x09, 0x09, 0x09, 0x01}},
                            glyph{'G', {0x3e, 0x41, 0x49, 0x49, 0x7a}}, glyph{'H', {0x7f, 0x08, 0x08, 0x08, 0x7f}},
                            glyph{'I', {0x00, 0x41, 0x7f, 0x41, 0x00}}, glyph{'J', {0x20, 0x40, 0x41, 0x3f, 0x01}},
                            glyph{'K', {0x7f, 0x08, 0x14, 0x22, 0x41}}, glyph{'L', {0x7f, 0x40, 0x40, 0x40, 0x40}},
                            glyph{'M', {0x7f, 0x02, 0x0c, 0x02, 0x7f}}, glyph{'N', {0x7f, 0x04, 0x08, 0x10, 0x7f}},
                            glyph{'O', {0x3e, 0x41, 0x41, 0x41, 0x3e}}, glyph{'P', {0x7f, 0x09, 0x09, 0x09, 0x06}},
                            glyph{'Q', {0x3e, 0x41, 0x51, 0x21, 0x5e}}, glyph{'R', {0x7f, 0x09, 0x19, 0x29, 0x46}},
                            glyph{'S', {0x46, 0x49, 0x49, 0x49, 0x31}}, glyph{'T', {0x01, 0x01, 0x7f, 0x01, 0x01}},
                            glyph{'U', {0x3f, 0x40, 0x40, 0x40, 0x3f}}, glyph{'V', {0x1f, 0x20, 0x40, 0x20, 0x1f}},
                            glyph{'W', {0x3f, 0x40, 0x38, 0x40, 0x3f}}, glyph{'X', {0x63, 0x14, 0x08, 0x14, 0x63}},
                            glyph{'Y', {0x07, 0x08, 0x70, 0x08, 0x07}}, glyph{'Z', {0x61, 0x51, 0x49, 0x45, 0x43}},
                            glyph{'%', {0x23, 0x13, 0x08, 0x64, 0x62}}, glyph{'(', {0x00, 0x1c, 0x22, 0x41, 0x00}},
                            glyph{')', {0x00, 0x41, 0x22, 0x1c, 0x00}}, glyph{'+', {0x08, 0x08, 0x3e, 0x08, 0x08}},
                            glyph{'-', {0x08, 0x08, 0x08, 0x08, 0x08}}, glyph{'.', {0x00, 0x60, 0x60, 0x00, 0x00}},
                            glyph{',', {0x00, 0x50, 0x30, 0x00, 0x00}}, glyph{'^', {0x04, 0x02, 0x01, 0x02, 0x04}}};

constexpr int advance = 6;  // pixels from one character to the next

class canvas {
 public:
  canvas(int width, int height) : pixels_(width, height, rgb8{255, 255, 255}) {}

  void fill(int x, int y, int width, int height, rgb8 color) {
    for (int v = y; v != y + height; ++v)
      for (int u = x; u != x + width; ++u) pixels_(u, v) = color;
  }
  /// To the right, or with `upward` turned by a quarter.
  void write(int x, int y, std::string_view text, rgb8 color, bool upward = false) {
    for (std::size_t n = 0; n != text.size(); ++n) {
      const char c = text[n] >= 'a' && text[n] <= 'z' ? static_cast<char>(text[n] - 'a' + 'A') : text[n];
      const auto* const found =
          std::find_if(glyphs.begin(), glyphs.end(), [&](const glyph& g) { return g.character == c; });
      if (found == glyphs.end()) continue;
      for (int column = 0; column != 5; ++column) {
        for (int row = 0; row != 7; ++row) {
          if ((found->columns[static_cast<std::size_t>(column)] >> row & 1) == 0) continue;
          const int along = advance * static_cast<int>(n) + column;
          const int u = upward ? x + row : x + along;
          const int v = upward ? y - along : y + row;
          if (u >= 0 && v >= 0 && u < pixels_.width() && v < pixels_.height()) pixels_(u, v) = color;
        }
      }
    }
  }
  [[nodiscard]] const image<rgb8>& pixels() const { return pixels_; }

 private:
  image<rgb8> pixels_;
};

/// Dark blue over green to yellow.
rgb8 color_of(double f1) {
  constexpr std::array<std::array<double, 3>, 5> stops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(f1, 0.0, 1.0) * (stops.size() - 1.0);
  const auto low = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  const double part = at - static_cast<double>(low);
  const auto channel = [&](std::size_t c) {
    return static_cast<std::uint8_t>(std::lround((1 - part) * stops[low][c] + part * stops[low + 1][c]));
  };
  return {channel(0), channel(1), channel(2)};
}

}  // namespace

bool write_heat_map(const score_table& table, const std::filesystem::path& path) {
  constexpr int cell_width = 24, cell_height = 22, left = 128, top = 176, margin = 8, gap = 6;
  constexpr rgb8 black{0, 0, 0}, white{255, 255, 255};
  // The automatic choice, then the fixed settings from the best to the worst.
  std::vector<std::size_t> order(table.settings.size());
  for (std::size_t s = 0; s != order.size(); ++s) order[s] = s;
  std::stable_sort(order.begin() + 1, order.end(), [&](auto a, auto b) { return table.mean_f1(a) > table.mean_f1(b); });
  std::vector<trouble> kinds;
  for (const trouble kind : all_troubles) {
    if (!is_clean(kind) && !std::isnan(table.mean_f1(0, kind))) kinds.push_back(kind);
  }
  const int columns = static_cast<int>(order.size()), rows = static_cast<int>(kinds.size()) + 1;
  canvas picture{left + columns * cell_width + gap + margin, top + rows * cell_height + gap + margin};
  const auto x_of = [&](int column) { return left + column * cell_width + (column > 0 ? gap : 0); };
  const auto y_of = [&](int row) { return top + row * cell_height + (row + 1 == rows ? gap : 0); };
  picture.write(margin, margin, "F1 OF OUTLIER REMOVAL", black);
  picture.write(margin, margin + 12, "KINDS BY SETTINGS", black);
  for (int c = 0; c != columns; ++c) {
    const std::size_t setting = order[static_cast<std::size_t>(c)];
    picture.write(x_of(c) + cell_width / 2 - 3, top - 6, table.settings[setting], black, true);
    for (int r = 0; r != rows; ++r) {
      const bool mean = r + 1 == rows;
      const double f1 = mean ? table.mean_f1(setting) : table.mean_f1(setting, kinds[static_cast<std::size_t>(r)]);
      picture.fill(x_of(c), y_of(r), cell_width - 1, cell_height - 1, color_of(f1));
      const int hundredths = static_cast<int>(std::lround(100 * f1));
      const std::string text = hundredths == 100 ? "1.0" : (hundredths < 10 ? ".0" : ".") + std::to_string(hundredths);
      picture.write(x_of(c) + 3, y_of(r) + 7, text, f1 > 0.6 ? black : white);
    }
  }
  for (int r = 0; r != rows; ++r) {
    const std::string name = r + 1 == rows ? "all" : std::string{to_string(kinds[static_cast<std::size_t>(r)])};
    picture.write(left - margin - advance * static_cast<int>(name.size()), y_of(r) + 7, name, black);
  }
  return io::write_png(path, picture.pixels()).has_value();
}

}  // namespace orbis::bench
