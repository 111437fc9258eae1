#include "cli/preview.h"

#include <algorithm>
#include <vector>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/report_page.h"
#include "harness/backends.h"
#include "model/at.h"
#include "model/io/atomic_file.h"
#include "report/page.h"

namespace cutproof::cli {

namespace {

// Some in which the blade is down, ascending: evenly over all of these, with the last one.
std::vector<int64_t> frames_of_the_blade(const Setup& setup) {
  constexpr std::size_t kMostFrames = 60;
  std::vector<int64_t> down, shown;
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    if (last_lowered(setup, frame) != nullptr) down.push_back(frame);
  }
  const std::size_t count = std::min(down.size(), kMostFrames);
  for (std::size_t k = 1; k <= count; ++k) shown.push_back(down[k * down.size() / count - 1]);
  return shown;
}

// As loaded, but with the skin that the first frame makes: a stage that moves nothing.
State with_skin(const fixtures::Built& built) {
  const std::unique_ptr<Backend> reference = harness::make_backend({});
  reference->load({built.setup}, {built.state});
  reference->run({Stage::skin, Stage::skin});
  return reference->snapshot().front();
}

}  // namespace

void write_preview(const std::string& path, const Scene& scene, const fixtures::Built& built,
                   const std::string& again) {
  const State state = with_skin(built);
  const std::vector<int64_t> frames = frames_of_the_blade(built.setup);
  const report::Source source = {built.setup, 1 + std::ssize(frames), [&](int64_t index) {
                                   io::Snapshot snapshot{Stage::skin, state};
                                   snapshot.state.frame = index == 0 ? 0 : frames[at(index - 1)] + 1;
                                   return snapshot;
                                 }};
  report::Results results;
  results.command = "preview";
  results.scene = scene.name;
  results.notes = built.notes;
  io::write_text(path,
                 report::page(source, results, again + " --check", made_by(again + " --preview " + quoted(path))));
}

}  // namespace cutproof::cli
