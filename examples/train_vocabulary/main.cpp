// SPDX-License-Identifier: BSD-3-Clause
//
// train_vocabulary train OUT | convert IN OUT | recall [VOCABULARY...]
//
// Trains a vocabulary on synthetic textures and rooms, and on recordings; converts DBoW2 and DBoW3 vocabularies;
// measures the recall of vocabularies in place recognition.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/core/file.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/places.hpp>

#include "../common/program.hpp"
#include "../common/same_file.hpp"
#include "load_vocabulary.hpp"
#include "recall.hpp"
#include "sources.hpp"

namespace places = orbis::places;

struct settings {
  std::vector<std::string> inputs, recordings;
  std::string input, output;
  std::size_t textures = 2000, rooms = 50, stride = 5;
  int features = 500, views = 12;
  places::training_options training{};
};

int report_error(int code, const std::string& why) { return examples::report_error("train_vocabulary", code, why); }

int write(const settings& s, const places::vocabulary& words) {
  const std::string bytes = places::vocabulary_bytes(words);
  const auto done = orbis::write_file_atomically(
      s.output, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
  if (!done) return report_error(2, examples::describe(done.error()));
  std::printf("%zu words, %zu nodes, %u levels, %zu bytes\n", words.size(), words.nodes(), words.depth(), bytes.size());
  return 0;
}

/// The error message if the output file belongs to one of the recordings; empty otherwise.
std::string overwritten_input(const settings& s) {
  std::error_code ignored;
  if (!std::filesystem::exists(s.output, ignored)) return {};
  for (const std::string& folder : s.recordings) {
    const auto recording = orbis::io::open_recording(folder);
    if (!recording) continue;  // reported when it is read
    for (const std::filesystem::path& file : recording->files())
      if (examples::is_same_file(s.output, file)) return examples::overwrite_message(s.output, file.string());
  }
  return {};
}

int train(const settings& s) {
  if (const std::string why = overwritten_input(s); !why.empty()) return report_error(1, why);
  if (const std::string why = examples::unwritable_message(s.output); !why.empty()) return report_error(2, why);
  std::vector<sources::descriptors> images = sources::of_textures(s.textures, s.training.seed, s.features);
  for (std::size_t room = 0; room != s.rooms; ++room)
    for (sources::view& v : sources::of_room(1000 * s.training.seed + room, s.views, s.features, room).views)
      images.push_back(std::move(v.found));
  for (const std::string& folder : s.recordings) {
    auto seen = sources::of_recording(folder, s.stride, s.features, 0);
    if (!seen) return report_error(2, examples::describe(seen.error()));
    for (sources::view& v : seen->views) images.push_back(std::move(v.found));
  }
  const auto words = places::train(orbis::par, images, s.training);
  if (!words) return report_error(2, examples::describe(words.error()));
  return write(s, *words);
}

int convert(const settings& s) {
  if (examples::is_same_file(s.output, s.input)) return report_error(1, examples::overwrite_message(s.output, s.input));
  if (const std::string why = examples::unwritable_message(s.output); !why.empty()) return report_error(2, why);
  const auto words = dbow::load_vocabulary(s.input);
  if (!words) return report_error(2, examples::describe(words.error()));
  if (words->empty()) return report_error(2, orbis::shortened_path(s.input) + ": the vocabulary contains no words");
  return write(s, *words);
}

int judge(const settings& s) {
  std::vector<std::pair<std::string, places::vocabulary>> all{{"(default)", places::default_vocabulary()}};
  for (const std::string& file : s.inputs) {
    auto words = dbow::load_vocabulary(file);
    if (!words) return report_error(2, examples::describe(words.error()));
    all.emplace_back(file.substr(file.find_last_of('/') + 1), *std::move(words));
  }
  std::vector<recall::task> tasks;
  if (s.rooms != 0) {
    recall::task rooms{.name = "rooms"};
    for (std::size_t room = 0; room != s.rooms; ++room) {
      const std::uint64_t seed = 500'000 + room;  // different from the training seeds
      auto first = sources::of_room(seed, 60, 1000, room), again = sources::of_room(seed, 60, 1000, room, true);
      rooms.camera = first.camera;
      std::ranges::move(first.views, std::back_inserter(rooms.map));
      std::ranges::move(again.views, std::back_inserter(rooms.queries));
    }
    tasks.push_back(std::move(rooms));
  }
  for (const std::string& folder : s.recordings) {
    auto seen = sources::of_recording(folder, s.stride, 1000, 0);
    if (!seen) return report_error(2, examples::describe(seen.error()));
    tasks.push_back({.name = folder.substr(folder.find_last_of('/') + 1),
                     .camera = seen->camera,
                     .map = std::move(seen->views),
                     .within = true,
                     .apart = std::max<std::size_t>(2, 60 / s.stride)});
  }
  std::printf("%-32s %8s %-12s %8s %8s %8s %10s %13s\n", "vocabulary", "words", "views", "queries", "first", "in ten",
              "candidate", "transform, ms");
  for (const auto& [name, words] : all)
    for (const recall::task& t : tasks) {
      const auto o = recall::measure(t, words);
      std::printf("%-32s %8zu %-12s %8zu %8.3f %8.3f %10.3f %13.3f\n", name.c_str(), words.size(), t.name.c_str(),
                  o.queries, o.first, o.among_ten, o.candidate, o.transform_ms);
    }
  return 0;
}

int run(int argc, char** argv) {
  settings s;
  CLI::App cli{"Train, convert and evaluate visual vocabularies", "train_vocabulary"};
  cli.require_subcommand(1);
  auto* const train_command = cli.add_subcommand("train", "train a vocabulary");
  train_command->add_option("OUT", s.output, "output file")->required();
  train_command->add_option("--textures", s.textures, "number of synthetic textures")->capture_default_str();
  train_command->add_option("--rooms", s.rooms, "number of synthetic rooms")->capture_default_str();
  train_command->add_option("--views", s.views, "views per room")->capture_default_str()->check(CLI::Range(1, 1000));
  train_command->add_option("--features", s.features, "features per image")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  train_command->add_option("--recording", s.recordings, "folders of recordings for training");
  train_command->add_option("--branching", s.training.branching)->capture_default_str()->check(CLI::Range(2, 65535));
  train_command->add_option("--depth", s.training.depth)->capture_default_str()->check(CLI::Range(1, 16));
  train_command->add_option("--seed", s.training.seed)->capture_default_str();
  auto* const convert_command = cli.add_subcommand("convert", "convert DBoW2's text or DBoW3's YAML format");
  convert_command->add_option("IN", s.input, "input vocabulary")->required();
  convert_command->add_option("OUT", s.output, "output file")->required();
  auto* const recall_command = cli.add_subcommand("recall", "measure the recall for revisited places");
  recall_command->add_option("VOCABULARY", s.inputs, "vocabularies to compare with the default one");
  recall_command->add_option("--rooms", s.rooms, "number of synthetic rooms, each visited twice")
      ->capture_default_str();
  recall_command->add_option("--recording", s.recordings, "folders of recordings with ground truth");
  for (auto* const command : {train_command, recall_command})
    command->add_option("--stride", s.stride, "use every N-th frame of a recording")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000));
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  if (train_command->parsed()) return train(s);
  return convert_command->parsed() ? convert(s) : judge(s);
}

int main(int argc, char** argv) {
  return examples::run_program("train_vocabulary", [&] { return run(argc, argv); });
}
