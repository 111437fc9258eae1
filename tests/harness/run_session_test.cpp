// What observes a run sees all of it, and what ends it early leaves nothing.
#include "harness/run_session.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "fixtures/build.h"
#include "model/error.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/cut_scene.h"

namespace cutproof::run_session_test {
namespace {

namespace files = std::filesystem;

// The reference, with a name of its own, that runs nothing but whole frames.
class WholeFrames final : public Backend {
 public:
  std::string name() const override { return "whole frames"; }
  Precision precision() const override { return inner_->precision(); }
  bool can_run(Span span) const override { return span.is_whole_frame(); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override { inner_->run(span); }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
};

class Session : public testing::Test {
 protected:
  Session() { files::create_directories(folder_); }
  ~Session() override { files::remove_all(folder_); }

  harness::RunSession session(harness::Observers wanted, Backend& backend) const {
    return {{built_.setup, built_.state, scene_.expect, backend.name(), io::write_scene(scene_)},
            std::move(wanted),
            backend,
            [] { return reference::make_backend(); }};
  }
  std::string path(const char* name) const { return folder_ / name; }
  bool is_clean() const { return files::is_empty(folder_); }

  files::path folder_ = files::temp_directory_path() / ("cutproof.session." + std::to_string(getpid()));
  Scene scene_ = io::parse_scene(tests::kCutScene, "the test's scene");
  fixtures::Built built_ = fixtures::build(scene_, "the test's scene");
  std::unique_ptr<Backend> backend_ = reference::make_backend();
};

TEST_F(Session, ShowsTheWholeRunToAllObservers) {
  harness::RunSession all = session({.judge = harness::Depth::motion,
                                     .against = harness::AgainstMode::both,
                                     .errors = harness::ErrorsWanted{.topology = true},
                                     .page = path("page.html")},
                                    *backend_);
  int64_t told = 0;
  all.run([&](const harness::FrameResult&) { ++told; });
  const int64_t frames = built_.setup.frame_count();
  EXPECT_EQ(told, frames);
  EXPECT_EQ(static_cast<int64_t>(all.frames().size()), frames);
  EXPECT_TRUE(all.holds());
  EXPECT_TRUE(all.judge()->not_reached().empty());
  EXPECT_EQ(all.errors()->topology().end.components, 2);
  for (const io::RecordingReader* recording : {all.recording(), all.reference_recording()}) {
    const io::Snapshot last = recording->snapshot(recording->header().snapshot_count - 1);
    EXPECT_EQ(last.stage, Stage::skin);
    EXPECT_EQ(last.state.frame, frames);
  }
  EXPECT_TRUE(is_clean()) << "what was recorded for a page has a name";
}

TEST_F(Session, LeavesNoRecordingWhereTheRunEndsEarly) {
  for (const bool is_kept : {true, false}) {
    harness::Observers wanted{.against = harness::AgainstMode::lockstep, .page = path("page.html")};
    if (is_kept) wanted.record = path("kept");
    {
      harness::RunSession broken = session(wanted, *backend_);
      EXPECT_THROW(broken.run([](const harness::FrameResult& frame) {
        if (frame.frame == 1) throw std::runtime_error("stopped");
      }),
                   std::runtime_error);
      EXPECT_FALSE(is_clean());
    }
    EXPECT_TRUE(is_clean());
  }
}

TEST_F(Session, RefusesToCompareStagesThatRunInOnePiece) {
  WholeFrames backend;
  EXPECT_THROW(session({.against = harness::AgainstMode::lockstep}, backend).run([](const harness::FrameResult&) {}),
               InputError);
}

}  // namespace
}  // namespace cutproof::run_session_test
