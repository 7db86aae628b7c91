// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>

#include <orbis/core/execution.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/places/default_vocabulary.hpp>
#include <orbis/places/detail/default_vocabulary_data.hpp>
#include <orbis/places/keyframe_database.hpp>
#include <orbis/places/vocabulary_file.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

TEST_CASE("the default vocabulary is there, whole, and no larger than it may be") {
  const vocabulary words = default_vocabulary();
  CHECK(words.size() > 5000);
  CHECK(words.depth() >= 3);
  CHECK(words.weighting() == weighting::tf_idf);
  CHECK(vocabulary_bytes(words).size() == places::detail::default_vocabulary_size);
  CHECK(places::detail::default_vocabulary_size < 800'000);  // a megabyte as text
  CHECK(default_vocabulary() == words);
}

TEST_CASE("with the default vocabulary a room it has never seen is recognised from another way through it") {
  const features::orb_extractor extract{{.max_features = 1000}};
  const vocabulary words = default_vocabulary();
  keyframe_database database;
  transform_workspace memory;
  constexpr int views = 24;
  const auto bag_of = [&](const io::synthetic_recording& room, std::size_t i) {
    const auto frame = room.render(seq, i).value();
    bag_of_words bag;
    words.transform(extract(image_view<const rgb8>{frame.color.view()}).descriptors, bag, memory);
    return bag;
  };
  io::synthetic_options options{.frames = views, .seed = 7001};
  const io::synthetic_recording first{options};
  for (std::uint32_t i = 0; i != views; ++i) database.add(i, bag_of(first, i));
  options.path.height = 1.5;
  options.path.semi_axis_x = 0.6;
  options.sensor.colour_noise = 4.0;
  const io::synthetic_recording again{options};
  int right = 0, asked = 0;
  for (std::size_t i = 2; i < views - 2; i += 2, ++asked) {
    const auto found = database.best(bag_of(again, i), 1);
    REQUIRE(found.size() == 1);
    const auto distance = found[0].id > i ? found[0].id - i : i - found[0].id;
    right += distance <= 1 ? 1 : 0;
  }
  CHECK(right * 10 >= asked * 8);
}
