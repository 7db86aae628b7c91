// SPDX-License-Identifier: BSD-3-Clause
//
// replay_<target> CORPUS [MUTATIONS]: runs a fuzz target, with any compiler and always the same way, on a file, or on
// every file of a folder and then on mutations of them: three of four of files that the reader accepts, as damage to a
// refused file is mostly refused for the same reason. If it ends badly, the input is left in failed_input.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include <orbis/core/file.hpp>
#include <orbis/core/random.hpp>

#include "fuzz/target.hpp"

namespace {

constexpr std::size_t longest = 8192;

std::string current;  // what the target is working on

extern "C" void keep_current_input(int signal) {
  if (const int file = open("failed_input", O_WRONLY | O_CREAT | O_TRUNC, 0644); file >= 0) {
    [[maybe_unused]] const auto written = write(file, current.data(), current.size());
    close(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(std::string input) {
  current = std::move(input);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(current.data()), current.size());
}

/// Changes a few things of the kind that damage, truncation and malice change.
class mutator {
 public:
  /// `accepted`: those of the corpus that are read without an error.
  mutator(std::uint64_t seed, const std::vector<std::string>& corpus, const std::vector<std::string>& accepted)
      : random_{seed}, corpus_{corpus}, accepted_{accepted} {}

  [[nodiscard]] std::string next() {
    std::string s = any_of(random_.below(4) == 0 ? corpus_ : accepted_);
    for (std::uint32_t n = 1 + random_.below(6); n != 0; --n) change(s);
    s.resize(std::min(s.size(), longest));
    return s;
  }

 private:
  [[nodiscard]] std::size_t at(const std::string& s) { return random_.below(static_cast<std::uint32_t>(s.size())); }
  [[nodiscard]] char byte() { return static_cast<char>(random_.below(256)); }
  [[nodiscard]] const std::string& any_of(const std::vector<std::string>& files) {
    return files[random_.below(static_cast<std::uint32_t>(files.size()))];
  }
  [[nodiscard]] std::string piece_of(const std::string& s) {
    const std::size_t begin = s.empty() ? 0 : at(s);
    return s.substr(begin, 1 + random_.below(32));
  }

  void change(std::string& s) {
    constexpr std::array<unsigned char, 8> edges{0x00, 0x01, 0x03, 0x55, 0x7f, 0x80, 0xaa, 0xff};
    constexpr std::array<std::string_view, 8> words{
        "18446744073709551615", "4294967296", "-1", "nan", "1e-320", "1e308", "\n", "data\n"};
    if (s.empty()) {
      s += byte();
      return;
    }
    switch (random_.below(9)) {
      case 0: s[at(s)] ^= static_cast<char>(1U << random_.below(8)); break;
      case 1: s[at(s)] = byte(); break;
      case 2: s[at(s)] = static_cast<char>(edges[random_.below(edges.size())]); break;
      case 3: s.insert(at(s), 1, byte()); break;
      case 4: s.erase(at(s), 1 + random_.below(16)); break;
      case 5: s.resize(at(s)); break;
      case 6: s.insert(at(s), piece_of(s)); break;
      case 7: s.insert(at(s), piece_of(any_of(corpus_))); break;
      default: {  // a number becomes another one
        const auto digit = s.find_first_of("0123456789", at(s));
        if (digit == std::string::npos) break;
        const auto end = std::min(s.find_first_not_of("0123456789", digit), s.size());
        s.replace(digit, end - digit, words[random_.below(words.size())]);
      }
    }
  }

  orbis::random_bits random_;
  const std::vector<std::string>& corpus_;
  const std::vector<std::string>& accepted_;
};

}  // namespace

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: %s CORPUS [MUTATIONS]\n", argv[0]);
    return 1;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, keep_current_input);

  std::vector<fs::path> files;
  if (fs::is_directory(argv[1])) {
    for (const auto& entry : fs::directory_iterator{argv[1]}) files.push_back(entry.path());
  } else {
    files.emplace_back(argv[1]);
  }
  std::sort(files.begin(), files.end());  // folders list in any order
  std::vector<std::string> corpus, accepted;
  for (const fs::path& file : files) {
    auto bytes = orbis::read_file(file);
    if (!bytes) {
      std::fprintf(stderr, "%s\n", bytes.error().to_string().c_str());
      return 1;
    }
    const std::size_t before = orbis::fuzz::accepted;
    run(*bytes);
    if (orbis::fuzz::accepted != before) accepted.push_back(*bytes);
    corpus.push_back(*std::move(bytes));
  }
  if (corpus.empty()) {
    std::fprintf(stderr, "%s: no inputs\n", argv[1]);
    return 1;
  }
  const int mutations = argc == 3 ? std::atoi(argv[2]) : 0;
  if (accepted.empty() && mutations != 0) {
    std::fprintf(stderr, "%s: none of the inputs is accepted\n", argv[1]);
    return 1;
  }
  mutator mutate{1, corpus, accepted};
  for (int i = 0; i != mutations; ++i) run(mutate.next());
  std::printf("%zu inputs, %zu of them accepted, %d mutations\n", corpus.size(), accepted.size(), mutations);
  return 0;
}
