// What a backend keeps of the bodies that it has loaded, wherever its kernels run.
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

// gpu: how the work of a span is started. All give the same bits.
enum class Path {
  graph,  // kernels and conditions as one CUDA graph
  eager,  // kernels one by one, waiting for each condition
};

// gpu: arrays of at least `array` bytes have memory only where they are touched, by pages of 2 MiB, if a load leaves at
// least `room` bytes of them empty (both small for tests). CUDA takes memory for pages by pieces of 128 MiB: the last
// of a load, and one that a frame begins, may be taken for next to nothing.
struct OnDemand {
  std::size_t array = std::size_t{4} << 20;
  std::size_t room = std::size_t{256} << 20;
};

struct KernelOptions {
  SplitMethod split = SplitMethod::blocks;
  Path path = Path::graph;
  Capacity capacity;  // at load; a backend doubles it when it must (for tests)
  OnDemand on_demand;
  int device = 0;  // gpu: its number
  // gpu, for tests: a byte that fills all memory before anything is put into it.
  std::optional<int> fill;
};

struct Load {
  std::vector<Setup> setups;
  Capacity capacity;
  StagingBuffers staging;  // contents only; where kernels work on them, the backend allocates the rest
  Plan plan;
  KnownSkins skins;  // of the last skin stage, as far as snapshots have asked for them

  Load() = default;
  // Throws what make_contents throws.
  Load(std::vector<Setup> bodies, const std::vector<State>& states, const KernelOptions& options, Capacity with);

  // The same bodies, now in these states, which are what `staging` holds, with twice the capacity. Leaves this load
  // without its setups.
  Load enlarged(const std::vector<State>& states, const KernelOptions& options);
  // To be called before a skin stage.
  void forget_skins() { skins.assign(setups.size(), std::nullopt); }
  // To be called before each span is run. Whether groups have to be made first (frame.h).
  bool needs_groups(Span span) {
    const bool needs = span.is_whole_frame() && !groups_made_;
    groups_made_ = span.is_whole_frame();
    return needs;
  }
  // As extract_states; `staging` holds what is to be extracted.
  std::vector<State> states_of(const std::vector<bool>& wanted) {
    return extract_states(staging, setups, wanted, skins);
  }

 private:
  bool groups_made_ = false;  // by the last span, for the next frame
};

}  // namespace cutproof::gpu
