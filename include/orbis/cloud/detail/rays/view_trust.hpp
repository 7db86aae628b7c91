// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Selection of depth measurements that are valid evidence: excludes stray pixels, and views whose pose is wrong.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/rays/depth_rows.hpp>
#include <orbis/cloud/detail/rays/take_depth_windows.hpp>
#include <orbis/cloud/detail/select/log_density.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/cloud/view_samples.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

/// For each depth of a row, counts with vector operations how many of the eight surrounding depths agree with it. This
/// first pass finds the many depths that agree with at least two. Reads sixteen depths beyond the rows.
struct count_agreeing_depths {
  using signature = void(const float*, const float*, const float*, float, float, float*, std::size_t);
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* above, const float* middle, const float* below, float margin,
                                      float margin_growth, float* out, std::size_t width) {
    using lanes = simd::native_vec<float, Target>;
    const lanes zero = 0.0F, one = 1.0F;
    for (std::size_t x = 0; x < width; x += lanes::count) {
      const lanes z = lanes::load(middle + x);
      const lanes widest = lanes(margin) + lanes(margin_growth) * z * z;
      lanes count = 0.0F;
      const auto look_at = [&](const float* other) ORBIS_INLINE_LAMBDA {
        const lanes d = lanes::load(other);
        count = count + select((d > zero) & (max(d - z, z - d) <= widest), one, zero);
      };
      look_at(above + x - 1);
      look_at(above + x);
      look_at(above + x + 1);
      look_at(middle + x - 1);
      look_at(middle + x + 1);
      look_at(below + x - 1);
      look_at(below + x);
      look_at(below + x + 1);
      count.store(out + x);
    }
  }
};

/// Writes the depth image in metres with stray pixels replaced. A pixel is stray if fewer than two of the pixels around
/// it agree with it within `margin + margin_growth z^2`. It is replaced with the median of their depths, or with 0 if
/// fewer than five of them have a depth. Unless replaced, a stray pixel would support itself and suppress the evidence
/// of the rays around it. O(pixels). `out` is resized if its size differs.
template <execution_policy Policy, camera::depth_source Depth>
void remove_stray_pixels(const Policy& policy, const Depth& depth, float margin, float margin_growth,
                         image<float>& out) {
  if (out.width() != depth.width() || out.height() != depth.height()) out = image<float>(depth.width(), depth.height());
  const depth_row_kernels kernels;
  const auto count_agreeing = simd::kernel<count_agreeing_depths, count_agreeing_depths::signature, simd::avx2>();
  const auto width = static_cast<std::size_t>(depth.width());
  constexpr std::size_t beside = 16;                           // number of depths that the kernel reads beyond a row
  const std::size_t stride = beside + (width + 31) / 16 * 16;  // stride of padded rows
  for_each_chunk(policy, static_cast<std::size_t>(depth.height()), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<float> rows(4 * stride, 0.0F);  // three rows of depths, padded with 0, and the counts
    const auto row = [&](std::size_t y) { return rows.data() + y % 3 * stride + beside; };
    const auto read = [&](std::size_t y) {  // `y` is the row + 1, so that it is never negative
      if (y == 0 || y > static_cast<std::size_t>(depth.height()))
        std::fill_n(row(y), width, 0.0F);
      else
        read_depth_row(kernels, depth, static_cast<int>(y) - 1, row(y));
    };
    float* const agreeing = rows.data() + 3 * stride;
    read(begin);
    read(begin + 1);
    for (std::size_t y = begin; y != end; ++y) {
      read(y + 2);
      const float* const middle = row(y + 1);
      count_agreeing(row(y), middle, row(y + 2), margin, margin_growth, agreeing, width);
      std::copy_n(middle, width, out.row(static_cast<int>(y)).begin());
      for (std::size_t x = 0; x != width; ++x) {
        const float z = middle[x];
        if (agreeing[x] >= 2.0F || !(z > 0)) continue;
        std::array<float, 8> around = depths_around(depth, static_cast<int>(x), static_cast<int>(y));
        if (agrees_with_neighbors(z, around, margin + margin_growth * z * z)) continue;
        const auto last = std::remove_if(around.begin(), around.end(), [](float d) { return !(d > 0); });
        const auto count = last - around.begin();
        float& replaced = out(static_cast<int>(x), static_cast<int>(y));
        replaced = 0;
        if (count < 5) continue;
        std::nth_element(around.begin(), around.begin() + count / 2, last);
        replaced = around[static_cast<std::size_t>(count / 2)];
      }
    }
  });
}

/// A view whose depth image has its stray pixels replaced.
struct cleaned_view {
  camera::depth_view<float> depth;
  se3 T_world_camera;
};

/// Cleans one view at a time. Reuses its memory.
class view_cleaner {
 public:
  /// Returns the cleaned view; valid until the next call.
  template <execution_policy Policy, posed_depth View>
  [[nodiscard]] cleaned_view clean(const Policy& policy, const View& view, const ray_evidence_options& options) {
    remove_stray_pixels(policy, view.depth, options.margin, options.margin_growth, depth_);
    return {camera::depth_view<float>(depth_), view.T_world_camera};
  }

 private:
  image<float> depth_;
};

/// Default callback for views: does nothing.
struct no_view_action {
  template <class View>
  void operator()(const View&, const cleaned_view&, const depth_windows&) const noexcept {}
};

struct view_trust_options {
  double conflict = 0.1;  ///< a view is distrusted only if its conflict exceeds this value
  double excess = 3;      ///< a view is distrusted only if its conflict exceeds this multiple of the usual one
  int samples = 20;       ///< number of samples along either axis of each view; > 0
  std::size_t least = 4;  ///< minimum number of views; with fewer, no view is distrusted
};

/// Indices, ascending, of the views that contradict the others, with measures of conflict.
struct view_trust {
  std::vector<std::uint32_t> distrusted;
  double worst_conflict = 0;  ///< largest conflict of a view with the others, 0 to 1
  double usual_conflict = 0;  ///< median conflict of the trusted views
};

/// Mutual evidence of two views: the number of samples in a tile of one view that the other view passes through or
/// supports.
struct view_verdict {
  std::uint32_t other;
  std::uint32_t rank;  ///< pseudo-random; decides which verdicts are kept if there are too many
  std::uint16_t through;
  std::uint16_t all;  ///< number of samples that the other view passes through or supports
  [[nodiscard]] double conflict() const noexcept { return static_cast<double>(through) / all; }
};

/// Rank of a verdict, the same for both views and independent of the order of processing.
[[nodiscard]] inline std::uint32_t verdict_rank(std::uint32_t of, std::uint32_t by, std::size_t tile) noexcept {
  return static_cast<std::uint32_t>(mix64((std::uint64_t{of} << 32U | by) ^ mix64(tile)) >> 32U);
}

/// Verdicts that involve one view. With up to 128 views, all are kept. Of more than `most` verdicts, those with the
/// lowest ranks are kept, which are an unbiased sample. Memory thus grows linearly with the number of views, and a view
/// that overlaps with few others loses no verdicts.
template <class = void>
class basic_view_verdicts {
 public:
  static constexpr std::size_t most = std::size_t{128} * 2 * 16;  ///< 128 views, 16 tiles of each and of this view

  /// Adds a verdict. O(log most).
  void add(const view_verdict& verdict) {
    if (kept_.size() < most) {
      kept_.push_back(verdict);
      if (kept_.size() == most) std::make_heap(kept_.begin(), kept_.end(), lower);
      return;
    }
    if (!lower(verdict, kept_.front())) return;
    std::pop_heap(kept_.begin(), kept_.end(), lower);
    kept_.back() = verdict;
    std::push_heap(kept_.begin(), kept_.end(), lower);
  }
  [[nodiscard]] std::span<const view_verdict> kept() const noexcept { return kept_; }

 private:
  [[nodiscard]] static bool lower(const view_verdict& a, const view_verdict& b) noexcept { return a.rank < b.rank; }
  std::vector<view_verdict> kept_;  // a heap with the highest rank in front once it is full
};
using view_verdicts = basic_view_verdicts<>;

/// Median of the conflicts of a view with the views that are not left out; 0 if there are too few. `verdicts`: the
/// verdicts that involve the view.
[[nodiscard]] inline double median_conflict(std::span<const view_verdict> verdicts, std::span<const char> left_out) {
  std::vector<double> values;
  for (const view_verdict& c : verdicts) {
    if (left_out[c.other] == 0) values.push_back(c.conflict());
  }
  if (values.size() < 10) return 0;
  return quantile(values, 0.5);
}

/// Finds views with wrong poses by comparing the views with each other. A sample of the pixels of each view is tested
/// by all others (`ray_evidence`), tile by tile. A view with a wrong pose is contradicted all over its image, a view
/// with a moving object only in a part of it, so the median over the tiles decides. The worst view is left out
/// repeatedly until no view stands out; if this would leave out half of the views, all are trusted. Deterministic.
/// Calls `also(view, cleaned view, its windows)` for each view, so that callers with further computations need no
/// second pass: views may be costly to read. `samples`: samples drawn from the views earlier, if any; otherwise each
/// view is read a second time. O(views (pixels + samples of all views)), and O(views) memory.
/// @pre views' images have the camera's size; the samples are from these views
template <execution_policy Policy, posed_depth_range Views, camera::camera_model Camera, class Also = no_view_action>
[[nodiscard]] view_trust find_distrusted_views(const Policy& policy, const Views& views, const Camera& camera,
                                               const ray_evidence_options& evidence = {},
                                               const view_trust_options& options = {}, progress on_progress = {},
                                               const Also& also = {}, const view_samples* samples = nullptr) {
  constexpr std::uint32_t tiles = view_samples::tiles;
  constexpr int enough = 6;  // minimum number of samples of a tile with evidence from another view
  const auto count = static_cast<std::uint32_t>(std::ranges::size(views));
  view_trust out;
  view_cleaner cleaner;
  depth_windows windows;
  if (count < options.least) {
    std::size_t done = 0;
    for (const auto& view : views) {
      const cleaned_view cleaned = cleaner.clean(policy, view, evidence);
      windows.take(policy, cleaned.depth, evidence.window);
      also(view, cleaned, windows);
      if (!on_progress(++done, count)) break;
    }
    return out;
  }

  view_samples drawn{evidence, options.samples};
  if (samples == nullptr)
    for (const auto& view : views) drawn.add(camera, view);
  const view_samples& asked = samples != nullptr ? *samples : drawn;
  assert(asked.views() == count);
  const std::span<const std::uint32_t> place = asked.tiles_by_point();  // indices of view and tile

  std::vector<view_verdicts> verdicts(count);
  ray_evidence_counter<Camera> counter{policy, asked.points(), camera, evidence};
  std::vector<ray_evidence> before = counter.scores();
  std::uint32_t by = 0;
  for (const auto& view : views) {
    const cleaned_view cleaned = cleaner.clean(policy, view, evidence);
    windows.take(policy, cleaned.depth, evidence.window);
    also(view, cleaned, windows);
    counter.add(policy, windows, cleaned.T_world_camera);
    std::vector<ray_evidence> scores = counter.scores();  // scores of all views so far
    for (std::size_t begin = 0; begin != place.size();) {
      std::size_t end = begin;
      const std::uint32_t of = place[begin] / (tiles * tiles);
      std::array<int, tiles * tiles> through{};
      std::array<int, tiles * tiles> supported{};
      for (; end != place.size() && place[end] / (tiles * tiles) == of; ++end) {
        through[place[end] % (tiles * tiles)] += scores[end].through - before[end].through;
        supported[place[end] % (tiles * tiles)] += scores[end].supported - before[end].supported;
      }
      begin = end;
      if (of == by) continue;
      for (std::size_t t = 0; t != tiles * tiles; ++t) {
        const int all = through[t] + supported[t];
        if (all < enough) continue;
        view_verdict verdict{by, verdict_rank(of, by, t), static_cast<std::uint16_t>(through[t]),
                             static_cast<std::uint16_t>(all)};
        verdicts[of].add(verdict);
        verdict.other = of;
        verdicts[by].add(verdict);
      }
    }
    before.swap(scores);
    if (!on_progress(++by, count)) return out;
  }

  std::vector<char> left_out(count, 0);
  std::vector<double> conflicts(count);
  for (;;) {
    std::vector<double> trusted;
    std::uint32_t worst = 0;
    for (std::uint32_t v = 0; v != count; ++v) {
      conflicts[v] = left_out[v] != 0 ? 0 : median_conflict(verdicts[v].kept(), left_out);
      if (left_out[v] == 0) trusted.push_back(conflicts[v]);
      if (conflicts[v] > conflicts[worst]) worst = v;
    }
    out.usual_conflict = quantile(trusted, 0.5);
    out.worst_conflict = std::max(out.worst_conflict, conflicts[worst]);
    if (conflicts[worst] <= options.conflict || conflicts[worst] <= options.excess * out.usual_conflict) break;
    left_out[worst] = 1;
    out.distrusted.push_back(worst);
    if (2 * out.distrusted.size() >= count) {  // it is unknown which half is correct
      out.distrusted.clear();
      break;
    }
  }
  std::sort(out.distrusted.begin(), out.distrusted.end());
  return out;
}

}  // namespace orbis::cloud::detail
