// The library's calls when an allocation fails in the middle of them: an exception, and nothing is lost. Blocks and
// file descriptors are counted before and after, each time in a process of its own, because a library may end it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "gpu/backends.h"
#include "harness/scene_judge.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/cli/chosen_allocations.h"
#include "tests/cli/failing_allocations.h"
#include "tests/cut_scene.h"

namespace cutproof::tests {
namespace {

namespace files = std::filesystem;

// How a process ends in which an allocation failed.
enum Ending { kThrew = 0, kSurvived = 1, kLost = 2, kTerminated = 3 };

std::ptrdiff_t open_files() {
  return std::distance(files::directory_iterator("/proc/self/fd"), files::directory_iterator());
}

class Leaks : public testing::Test {
 protected:
  Leaks()
      : scene(io::parse_scene(kCutScene, "the test's scene")),
        built(fixtures::build(scene, "the test's scene")),
        folder(files::temp_directory_path() / ("cutproof.leaks." + std::to_string(getpid()))) {
    files::create_directories(folder);
    take_snapshots();
  }
  ~Leaks() override { files::remove_all(folder); }

  void take_snapshots() {
    snapshots.clear();
    const auto backend = reference::make_backend();
    backend->load({built.setup}, {built.state});
    snapshots.push_back({Stage::skin, built.state});
    for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) {
      for (const Stage stage : kStages) {
        backend->run({stage, stage});
        snapshots.push_back({stage, backend->snapshot().front()});
      }
    }
  }
  void judge() const {
    harness::Snapshot before = std::make_shared<const State>(snapshots.front().state);
    harness::SceneJudge judge(built.setup, scene.expect, "reference", before);
    for (std::size_t k = 1; k < snapshots.size(); ++k) {
      const auto after = std::make_shared<const State>(snapshots[k].state);
      judge.see({0, {snapshots[k].stage, snapshots[k].stage}, std::exchange(before, after), after, true});
    }
    judge.finish();
  }
  std::string recording() const { return (folder / "r").string(); }
  void record() const {
    io::Recorder recorder(recording(), built.setup, kCutScene, "reference");
    for (const io::Snapshot& snapshot : snapshots) recorder.add(snapshot.stage, snapshot.state);
    recorder.finish();
  }
  void run(Backend& backend) const {
    backend.load({built.setup}, {built.state});
    for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) backend.run({Stage::step, Stage::skin});
    static_cast<void>(backend.snapshot());
  }

  // Lets allocations of `call` fail, one in each run. `may_terminate`: a destructor of a library that needs memory is
  // in it. `may_lose`: as many blocks, in a library.
  void fail_each(const std::function<void()>& call, bool may_terminate = false, int64_t may_lose = 0) {
    if (std::string(CUTPROOF_SANITIZERS) != "") {
      GTEST_SKIP() << "leaks were not run: sanitizers (" CUTPROOF_SANITIZERS ") bring their own allocator";
    }
    call();  // what the libraries keep for good
    const uint64_t made = count(call);
    ASSERT_GT(made, 0u);
    const uint64_t seed = sample_seed();
    std::map<int, int> ended;
    for (const uint64_t number : chosen_numbers(made, wanted_allocations(150), seed)) {
      const int ending = in_a_process(call, number, may_lose);
      ++ended[ending];
      if (ending == kThrew || ending == kSurvived || (ending == kTerminated && may_terminate)) continue;
      ADD_FAILURE() << "allocation " << number << " of " << made << ", seed " << seed << ": "
                    << (ending == kLost         ? "something is lost"
                        : ending == kTerminated ? "an exception met nobody"
                                                : "status " + std::to_string(ending));
      if (ended[ending] == 10) break;
    }
    EXPECT_GT(ended[kThrew], 0);
    std::cout << made << " allocations, seed " << seed << "; threw " << ended[kThrew] << ", survived "
              << ended[kSurvived] << ", terminated " << ended[kTerminated] << std::endl;
  }

  Scene scene;
  fixtures::Built built;
  std::vector<io::Snapshot> snapshots;
  files::path folder;

 private:
  static uint64_t count(const std::function<void()>& call) {
    AllocationControl control;
    control_allocations(&control);
    call();
    control_allocations(nullptr);
    return control.made;
  }

  static int in_a_process(const std::function<void()>& call, uint64_t number, int64_t may_lose) {
    const pid_t child = fork();
    if (child == 0) {
      std::set_terminate([] { std::_Exit(kTerminated); });
      alarm(60);
      std::_Exit(failing(call, number, may_lose));
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) throw std::runtime_error("no process can be made");
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  static int failing(const std::function<void()>& call, uint64_t number, int64_t may_lose) {
    AllocationControl control;
    control.fail_at = number;
    H5garbage_collect();
    const std::ptrdiff_t files_before = open_files();
    const int64_t blocks_before = live_blocks();
    Ending ending = kSurvived;
    control_allocations(&control);
    try {
      call();
    } catch (const std::exception&) {
      ending = kThrew;
    }
    control_allocations(nullptr);
    H5garbage_collect();
    const int64_t lost = live_blocks() - blocks_before;
    if (lost <= may_lose && open_files() == files_before) return ending;
    std::fprintf(stderr, "%lld blocks and %lld files are lost\n", static_cast<long long>(lost),
                 static_cast<long long>(open_files() - files_before));
    return kLost;
  }
};

TEST_F(Leaks, AreNotInReadingAScene) {
  fail_each([] { static_cast<void>(io::parse_scene(kCutScene, "the test's scene")); }, true);
}

TEST_F(Leaks, AreNotInBuildingAScene) {
  fail_each([&] { static_cast<void>(fixtures::build(scene, "the test's scene")); });
}

TEST_F(Leaks, AreNotInRunningTheReference) {
  fail_each([&] { run(*reference::make_backend()); });
}

TEST_F(Leaks, AreNotInRunningKernelsOnOneThread) {
  fail_each([&] { run(*gpu::make_host_backend(1)); });
}

TEST_F(Leaks, AreNotInRunningKernelsOnThreeThreads) {
  fail_each([&] { run(*gpu::make_host_backend(3)); });
}

TEST_F(Leaks, AreNotInRunningKernelsUnderASimulatedSchedule) {
  fail_each([&] {
    gpu::SimulationOptions simulation;
    simulation.schedule = gpu::random_walk(1);
    simulation.record = true;
    run(*gpu::make_simulated_backend(std::move(simulation)));
  });
}

TEST_F(Leaks, AreNotInJudgingTissue) {
  built.setup.skin.wanted = false;
  built.state.skin = {};
  scene.expect = {};  // counts shells of the skin
  take_snapshots();
  fail_each([&] { judge(); });
}

// CGAL 5.5 loses a property of a mesh, an array and what describes it, where there is no memory for the array or for
// noting it (Surface_mesh/Properties.h, add).
TEST_F(Leaks, AreNotInJudgingTheSkinToo) {
  fail_each([&] { judge(); }, false, 2);
}

TEST_F(Leaks, AreNotInRecording) {
  fail_each([&] { record(); });
  for (const auto& entry : files::directory_iterator(folder)) {
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << "left behind: " << entry.path();
  }
}

TEST_F(Leaks, AreNotInReadingARecording) {
  record();
  fail_each([&] {
    const io::RecordingReader reader(recording());
    for (int64_t k = 0; k < reader.header().snapshot_count; ++k) static_cast<void>(reader.snapshot(k));
  });
}

}  // namespace
}  // namespace cutproof::tests
