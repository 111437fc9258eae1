// A backend's record of its loaded bodies, wherever its kernels run.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "gpu/state/plan.h"
#include "gpu/state/staging.h"
#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof::gpu {

// gpu: how the work of a span is started. All paths give the same bits.
enum class Path {
  graph,  // kernels and conditions as one CUDA graph
  eager,  // kernels one by one, waiting for each condition
};

// gpu: arrays of at least `array` bytes get memory where they are touched, in pages of 2 MiB. This applies if a load
// leaves at least `room` bytes of them empty. (Both are small for tests.) CUDA allocates pages in pieces of 128 MiB.
// The last piece of a load may stay nearly empty, as may a piece that a frame begins.
struct OnDemand {
  std::size_t array = std::size_t{4} << 20;
  std::size_t room = std::size_t{256} << 20;
};

struct KernelOptions {
  SplitMethod split = SplitMethod::blocks;
  Path path = Path::graph;
  Capacity capacity;  // at load; backends double it when needed (for tests)
  OnDemand on_demand;
  int device = 0;  // gpu: its number
  // gpu, for tests: a byte that fills all memory before use.
  std::optional<int> fill;
};

struct Load {
  std::vector<Setup> setups;
  Capacity capacity;
  StagingBuffers staging;  // contents only; backends with memory of their own allocate the rest
  Plan plan;
  KnownSkins skins;  // of the last skin stage, as far as snapshots requested them

  Load() = default;
  // Throws as make_contents does.
  Load(std::vector<Setup> bodies, const std::vector<State>& states, const KernelOptions& options, Capacity with);

  // The same bodies in these states, which `staging` contains, with twice the capacity. Leaves this load without
  // setups.
  Load enlarged(const std::vector<State>& states, const KernelOptions& options);
  // Call before a skin stage.
  void forget_skins() { skins.assign(setups.size(), std::nullopt); }
  // Call before each span is run. Whether groups must be made first (frame.h).
  bool needs_groups(Span span) {
    const bool needs = span.is_whole_frame() && !groups_made_;
    groups_made_ = span.is_whole_frame();
    return needs;
  }
  // As extract_states; `staging` contains the states.
  std::vector<State> states_of(const std::vector<bool>& wanted) {
    return extract_states(staging, setups, wanted, skins);
  }

 private:
  bool groups_made_ = false;  // by the last span, for the next frame
};

}  // namespace cutproof::gpu
