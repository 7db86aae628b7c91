// SPDX-License-Identifier: BSD-3-Clause
#include <exception>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <opencv2/core.hpp>

#include "../common/memory.hpp"
#include "../common/program.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "interrupts.hpp"
#include "result_files.hpp"

namespace {

/// Returns large blocks to the system as soon as they are freed, and makes threads share heaps. Otherwise, fragments
/// left by tracking would make up half of the memory during mapping. Images are smaller than large blocks, and the heap
/// itself shrinks in steps of several images, because otherwise every image would cause page faults again.
void set_up_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 8 << 20);
  mallopt(M_ARENA_MAX, 2);
#endif
  // Otherwise, OpenCV would report a lack of memory as a `cv::Exception`.
  cv::redirectError([](int status, const char*, const char*, const char*, int, void*) {
    if (status == cv::Error::StsNoMem) throw std::bad_alloc{};
    return 0;
  });
}

}  // namespace

int run(int argc, char** argv) {
  const auto parsed = app::read_command_line(argc, argv);
  if (const auto* code = std::get_if<app::exit_code>(&parsed)) return *code;
  app::interrupts::start();
  const auto& settings = std::get<app::settings>(parsed);
  app::console console{settings.quiet};
  try {
    if (const auto finished = app::finish_earlier_runs(settings); !finished)
      return console.error(finished.error()), app::bad_input;
    switch (settings.what) {
      case app::command::run:
      case app::command::demo:
      case app::command::live: return app::run_slam(settings, console);
      case app::command::eval: return app::evaluate(settings, console);
      case app::command::map: return app::map_without_slam(settings, console);
      case app::command::plan: return app::plan(settings, console);
      case app::command::calibrate: return app::calibrate(settings, console);
      case app::command::benchmark: return app::benchmark(settings, console);
    }
  } catch (const std::exception& e) {  // out of memory or threads
    console.error({orbis::errc::unreadable, {}, examples::describe_exception(e)});
  }
  return app::bad_input;
}

int main(int argc, char** argv) {
  set_up_memory();
  return examples::run_program("rgbd_slam", [&] { return run(argc, argv); });
}
