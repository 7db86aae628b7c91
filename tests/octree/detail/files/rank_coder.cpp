// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/files/range_coder.hpp>
#include <orbis/octree/detail/files/rank_coder.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("Ranks of any size come back") {
  for (const std::uint32_t count : {1U, 2U, 3U, 17U, 1000U, 0x80000000U, 0xffffffffU}) {
    random_bits random{83};
    std::vector<std::uint32_t> ranks{0, count - 1, count / 2};
    for (int i = 0; i != 3000; ++i) ranks.push_back(random.below(count) >> random.below(32));
    range_encoder encoder;
    rank_coder<range_encoder> writer{encoder};
    for (std::size_t i = 0; i != ranks.size(); ++i) writer.code(i & 1U, ranks[i], count);
    const std::string coded = encoder.finish();
    range_decoder decoder{std::as_bytes(std::span{coded})};
    rank_coder<range_decoder> reader{decoder};
    bool same = true;
    for (std::size_t i = 0; i != ranks.size(); ++i) same &= reader.code(i & 1U, 0, count) == ranks[i];
    CHECK(same);
  }
}
