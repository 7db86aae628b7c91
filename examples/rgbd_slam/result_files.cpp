// SPDX-License-Identifier: BSD-3-Clause
#include "result_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <orbis/core/file.hpp>

#include "../common/same_file.hpp"
#include "interrupts.hpp"

namespace app {

namespace fs = std::filesystem;
using orbis::result;

namespace {

constexpr std::array trajectory_names = {"trajectory.txt", "keyframes.txt", "camera_used.toml", "trajectory.png"};
constexpr std::array map_names = {"cloud.ply", "cloud_filtered.ply", "map_unfiltered.bt", "map.bt",        "map.ot",
                                  "map.png",   "map_unfiltered.png", "filter.png",        "navigation.png"};
constexpr std::array report_names = {"summary.json", "report.html"};

file_names all_names() {
  file_names names = {"trajectory.txt",     "keyframes.txt",     "camera_used.toml", "cloud.ply",
                      "cloud_filtered.ply", "map_unfiltered.bt", "map.bt",           "map.ot",
                      "summary.json",       "report.html",       "trajectory.png",   "map.png",
                      "map_unfiltered.png", "filter.png",        "navigation.png"};
  for (std::size_t map = most_maps; map != 1; --map) names.insert(names.begin() + 1, trajectory_name(map));
  return names;
}

template <class Names>
bool is_among(const std::string& name, const Names& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

/// The result files in `folder` that this program wrote, according to its summary.json.
file_names recorded(const fs::path& folder) {
  const auto text = orbis::read_file(folder / "summary.json");
  if (!text) return {};
  const auto summary = nlohmann::json::parse(*text, nullptr, false);
  if (!summary.is_object() || !summary.contains("tracked") || !summary.contains("octree")) return {};
  if (!summary.contains("files")) return all_names();  // written by a version without this list
  file_names names;
  for (const char* list : {"files", "files_of_earlier_runs"})
    if (const auto found = summary.find(list); found != summary.end() && found->is_array())
      for (const auto& name : *found)
        if (name.is_string()) names.push_back(name.get<std::string>());
  return names;
}

fs::path parent_folder(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path{"."}; }

/// The image that belongs to a floor map.
fs::path floor_image(const fs::path& floor_map) { return fs::path{floor_map}.replace_extension(".pgm"); }

/// The files that the run may write, except for the landmark map.
std::vector<fs::path> target_files(const settings& s) {
  std::vector<fs::path> targets;
  for (const std::string& name : result_names(s)) targets.push_back(s.out / name);
  if (!s.floor_map.empty()) {
    targets.push_back(s.floor_map);
    targets.push_back(floor_image(s.floor_map));
  }
  return targets;
}

/// Returns true if a file belongs to another user, in a folder in which only the owners of files may replace them, such
/// as /tmp.
bool is_protected(const fs::path& path) {
  struct stat file {};
  struct stat parent {};
  if (::lstat(path.c_str(), &file) != 0 || ::stat(parent_folder(path).c_str(), &parent) != 0) return false;
  const uid_t user = ::geteuid();
  return (parent.st_mode & S_ISVTX) != 0 && user != 0 && user != file.st_uid && user != parent.st_uid;
}

using identity = std::pair<dev_t, ino_t>;
std::optional<identity> find_identity(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return identity{status.st_dev, status.st_ino};
}

/// Never destroyed, as the thread that waits for signals may use it until the process ends.
hidden_folders& hidden() {
  static hidden_folders& folders = *new hidden_folders;
  return folders;
}

/// Cleans up when a signal ends the program.
void remove_hidden_folders() {
  const std::lock_guard lock{hidden().mutex};
  std::error_code ignored;
  // Removal fails if another thread creates a file at this moment, and is then tried again. Once the folder is gone, no
  // file can be created in it.
  for (auto path = hidden().paths.rbegin(); path != hidden().paths.rend(); ++path)
    for (int i = 0; i != 1000 && fs::exists(*path, ignored); ++i) fs::remove_all(*path, ignored);
}

}  // namespace

std::string trajectory_name(std::size_t number) { return "trajectory_" + std::to_string(number) + ".txt"; }

file_names result_names(const settings& s) {
  file_names names;
  for (std::string& name : all_names()) {
    const bool is_trajectory = is_among(name, trajectory_names) || name.starts_with("trajectory_");
    const bool made = is_among(name, report_names) || (s.what != command::map && is_trajectory) ||
                      (!s.localize_only && is_among(name, map_names));
    if (made) names.push_back(std::move(name));
  }
  return names;
}

std::vector<fs::path> input_files(const settings& s, std::vector<fs::path> source_files) {
  std::vector<fs::path> inputs = std::move(source_files);
  inputs.push_back(s.input);
  inputs.push_back(s.config);
  if (is_file_name(s.camera)) inputs.emplace_back(s.camera);
  return inputs;
}

std::optional<orbis::error> find_overwritten(const std::vector<fs::path>& targets,
                                             const std::vector<fs::path>& inputs) {
  std::vector<std::pair<identity, fs::path>> there;
  for (const fs::path& target : targets)
    if (const auto id = find_identity(target)) there.emplace_back(*id, target);
  if (there.empty()) return std::nullopt;
  for (const fs::path& input : inputs) {
    const auto id = find_identity(input);
    for (const auto& [of_target, target] : there)
      if (id == of_target)
        return orbis::error{
            orbis::errc::invalid_argument, target.string(),
            "is an input of this run (" + input.string() + ") and would be overwritten: choose another output"};
  }
  return std::nullopt;
}

result<void> finish_earlier_runs(const settings& s) {
  std::error_code ignored;
  const fs::path camera = is_file_name(s.camera) ? s.camera : std::string{};
  for (const fs::path& path : {s.out, s.save_map, s.floor_map, s.input, s.reference, s.load_map, camera})
    if (!path.empty())
      if (auto done = staged_folder::finish(fs::is_directory(path, ignored) ? path : parent_folder(path)); !done)
        return done;
  return {};
}

std::optional<orbis::error> find_overwritten(const settings& s, const std::vector<fs::path>& inputs) {
  std::vector<fs::path> targets = target_files(s);
  // A landmark map may overwrite the loaded one if the user asks for it.
  if (auto found = find_overwritten(targets, {s.load_map})) return found;
  targets.push_back(s.save_map);
  if (auto found = find_overwritten(targets, inputs)) return found;

  const file_names ours = recorded(s.out);
  const fs::path floor_picture = floor_image(s.floor_map);
  if (!s.floor_map.empty() && is_there(floor_picture)) {  // the user has not named it
    const auto map = orbis::read_file(s.floor_map);
    if (!map || map->find(floor_picture.filename().string()) == std::string::npos)
      return orbis::error{orbis::errc::invalid_argument, floor_picture.string(),
                          "exists and is not the image of " + s.floor_map.string() +
                              ", so it is not replaced: move it, or choose another --floor-map"};
  }
  for (const std::string& name : result_names(s))
    if (is_there(s.out / name) && !is_among(name, ours))
      return orbis::error{orbis::errc::invalid_argument, (s.out / name).string(),
                          "exists and is not listed as a result of rgbd_slam in summary.json, so it is not replaced: "
                          "move it, or choose another --out"};
  return std::nullopt;
}

std::optional<orbis::error> find_unwritable(const settings& s) {
  std::vector<fs::path> folders{s.out};
  for (const fs::path& file : {s.save_map, s.floor_map})
    if (!file.empty()) folders.push_back(parent_folder(file));
  for (const fs::path& folder : folders) {
    fs::path there = folder;
    while (!is_there(there) && there.has_relative_path()) there = parent_folder(there);
    const std::string text = (there / "").string();  // must be a folder
    if (::access(text.c_str(), W_OK | X_OK) == 0) continue;
    const int why = errno;
    return orbis::error{orbis::errc::write_failed, folder.string(),
                        "cannot create files in " + there.string() + ": " + std::generic_category().message(why)};
  }
  std::vector<fs::path> targets = target_files(s);
  targets.push_back(s.save_map);
  for (const fs::path& target : targets)
    if (is_protected(target))
      return orbis::error{orbis::errc::write_failed, target.string(), "belongs to another user and cannot be replaced"};
  return std::nullopt;
}

/// Checks in advance that the process can open a few more files, because a run that cannot do so at its end would lose
/// its results.
result<void> check_descriptors(const fs::path& out) {
  std::vector<descriptor> spare;
  for (int i = 0; i != 8; ++i)
    if (spare.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC)).get() < 0)
      return orbis::fail(orbis::errc::write_failed, out.string(),
                         "cannot create files in it: " + std::generic_category().message(errno));
  return {};
}

result<result_files> result_files::begin(const settings& s) {
  if (auto enough = check_descriptors(s.out); !enough) return orbis::fail(enough.error());
  result_files files;
  files.out_ = s.out;
  struct place {
    fs::path folder;
    file_names names;
  };
  std::vector<place> places{{s.out, result_names(s)}};
  const auto fail = [](const fs::path& path, const std::string& why) {
    return orbis::fail(orbis::errc::invalid_argument, path.string(), "the map cannot be saved: " + why);
  };
  std::error_code ec;
  // Adds a file that may be outside the output folder. `others`: all files that are created with it.
  const auto add = [&](const fs::path& file, const file_names& others, std::size_t& index) -> result<void> {
    const fs::path folder = parent_folder(file);
    for (const fs::path& f : {s.out, folder})
      if (fs::create_directories(f, ec); ec)
        return orbis::fail(orbis::errc::write_failed, f.string(), "cannot be created: " + ec.message());
    for (index = 0; index != places.size() && !examples::is_same_file(places[index].folder, folder);) ++index;
    if (index == places.size()) places.push_back({folder, {}});
    file_names& names = places[index].names;
    for (const std::string& name : others) {
      if (name.starts_with(staged_folder::private_name))
        return fail(file, std::string{"names that begin with "} + staged_folder::private_name + " are reserved");
      if (is_among(name, names) || (index == 0 && is_among(name, all_names())))
        return fail(file, "another result has this name");
      names.push_back(name);
      if (const auto there = fs::status(folder / name, ec); fs::exists(there) && !fs::is_regular_file(there))
        return fail(folder / name, "the existing file is not a regular file and will not be replaced");
    }
    return {};
  };
  if (!s.save_map.empty()) {
    files.map_name_ = s.save_map.filename().string();
    if (files.map_name_.empty() || files.map_name_ == "." || files.map_name_ == "..")
      return fail(s.save_map, "not a file name");
    if (auto added = add(s.save_map, {files.map_name_}, files.map_folder_); !added) return orbis::fail(added.error());
  }
  if (!s.floor_map.empty()) {
    files.floor_name_ = s.floor_map.filename().string();
    const std::string picture = floor_image(s.floor_map).filename().string();
    if (auto added = add(s.floor_map, {files.floor_name_, picture}, files.floor_folder_); !added)
      return orbis::fail(added.error());
  }
  interrupts::set_clean_up(remove_hidden_folders);
  for (place& p : places) {
    auto folder = staged_folder::open(p.folder, std::move(p.names), hidden());
    if (!folder) return orbis::fail(folder.error());
    files.folders_.push_back(*std::move(folder));
  }
  return files;
}

result_files::~result_files() {
  if (folders_.empty()) return;
  while (!folders_.empty()) folders_.pop_back();  // the first one last, as it lists the others
  interrupts::set_clean_up({});
  const std::lock_guard lock{hidden().mutex};
  hidden().paths.clear();
}

file_names file_lists::made(const file_names& coming) const {
  file_names names;
  for (std::string& name : all_names())
    if (is_there(folder_ / name) || is_among(name, coming)) names.push_back(std::move(name));
  return names;
}

file_names file_lists::of_earlier_runs(const file_names& made) const {
  file_names names = recorded(out_);
  std::erase_if(names, [&](const std::string& name) {
    return is_among(name, made) || !is_among(name, all_names()) || !is_there(out_ / name);
  });
  return names;
}

orbis::error result_files::with_final_path(orbis::error e) const {
  if (e.where.empty()) e.where = out_.string();
  for (const staged_folder& f : folders_)
    if (e.where.starts_with((f.path() / "").string()))
      e.where = ((&f == &folders_.front() ? out_ : f.target()) / fs::path{e.where}.filename()).string();
  return e;
}

bool result_files::is_deleted(const staged_folder& f, const std::error_code& error) const {
  return &f != &folders_.front() && error == std::errc::no_such_file_or_directory;
}

result<void> result_files::begin_optional() {
  std::error_code ec;
  for (const staged_folder& f : folders_)
    if (fs::create_directories(f.path() / optional_name, ec); ec && !is_deleted(f, ec))
      return orbis::fail(orbis::errc::write_failed, out_.string(), "cannot create files in it: " + ec.message());
  return {};
}

result<void> result_files::take_optional() {
  std::error_code ec;
  std::vector<std::pair<fs::path, fs::path>> moves;
  for (const staged_folder& f : folders_) {
    const fs::path folder = f.path();
    for (fs::directory_iterator it{folder / optional_name, ec}, end; !ec && it != end; it.increment(ec))
      moves.emplace_back(it->path(), folder / it->path().filename());
    if (is_deleted(f, ec)) ec.clear();
  }
  std::size_t moved = 0;
  while (!ec && moved != moves.size()) {
    fs::rename(moves[moved].first, moves[moved].second, ec);
    if (!ec) ++moved;
  }
  if (!ec) return {};
  std::error_code ignored;
  while (moved-- != 0) fs::rename(moves[moved].second, moves[moved].first, ignored);
  return orbis::fail(orbis::errc::write_failed, out_.string(), "cannot move the new files: " + ec.message());
}

void result_files::drop_optional() noexcept {
  try {
    for (const staged_folder& f : folders_) fs::remove_all(f.path() / optional_name);
  } catch (const std::exception&) {  // the files are removed at the end
  }
}

bool result_files::drop_landmark_map() const {
  std::error_code ignored;
  return !map_name_.empty() && fs::remove(landmark_map(), ignored);
}

result<void> result_files::put_in_place() {
  std::vector<staged_folder*> folders;
  for (staged_folder& f : folders_) folders.push_back(&f);
  return staged_folder::put_in_place(folders, hidden(), [this] { list_other_results(); });
}

void result_files::list_other_results() const {
  constexpr const char* list = "files_of_earlier_runs";
  const fs::path path = folder() / "summary.json";
  const auto text = orbis::read_file(path);
  if (!text) return;  // this run has none
  auto summary = nlohmann::ordered_json::parse(*text, nullptr, false);
  const auto made = summary.find("files");
  if (made == summary.end()) return;
  const file_names others = lists().of_earlier_runs(made->get<file_names>());
  if (summary.value(list, file_names{}) == others) return;
  summary[list] = others;
  static_cast<void>(orbis::write_file_atomically(path, [&](std::ostream& out) {
    out << summary.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  }));  // without space on the disk, the list remains as it is
}

}  // namespace app
