#include "benchmarks/phase_counter.h"

#include <algorithm>
#include <cstddef>

#include "gpu/frame.h"

namespace cutproof::benchmarks {

namespace {

// A Launcher (gpu/launch/launcher.h) that launches nothing.
class PhaseCounter {
 public:
  int64_t phases() const { return phases_; }

  template <class Kernel, class... Args>
  void items(Kernel, int64_t, const Args&...) {
    ++phases_;
  }
  template <class Kernel, class... Args>
  void teams(Kernel, int, int64_t, const Args&...) {
    ++phases_;
  }
  template <class Kernel, class... Args>
  void blocks(Kernel, int64_t, int, std::size_t, const Args&...) {
    ++phases_;
  }
  // The body waits for a node that reads the flag.
  template <class Body>
  void if_nonzero(const int* flag, Body body) {
    ++phases_;
    if (*flag != 0) body(*this);
  }
  template <class Body>
  void while_nonzero(int*, Body body) {
    ++phases_;
    body(*this);
  }
  static constexpr bool overlaps() { return true; }
  // The longest of the chains counts.
  template <class First, class Second, class AfterFirst = gpu::NoWork, class AfterBoth = gpu::NoWork>
  void side_by_side(First first, Second second, AfterFirst after_first = {}, AfterBoth after_both = {}) {
    PhaseCounter beside;
    beside.phases_ = phases_;
    first(*this);
    second(beside);
    beside.phases_ = std::max(beside.phases_, phases_);
    after_first(*this);
    after_both(beside);
    phases_ = std::max(phases_, beside.phases_);
  }
  void exclusive_scan(const int*, int*, int64_t, int*, const int* = nullptr) { ++phases_; }
  void select(const unsigned char*, int64_t, int*, int*, const int* = nullptr) { ++phases_; }
  void sort_unique(unsigned long long*, int*, int64_t) { ++phases_; }
  void clear(void*, std::size_t) { ++phases_; }

 private:
  int64_t phases_ = 0;
};

}  // namespace

std::array<int64_t, kStages.size()> phases_of_stages(const gpu::Plan& plan) {
  gpu::Counters counters = {};
  counters.changing = counters.expanding = counters.additions = counters.small = counters.groups_stale = 1;
  gpu::DeviceView view;
  view.bodies = 1;
  view.counters = &counters;
  std::array<int64_t, kStages.size()> phases = {};
  for (const Stage stage : kStages) {
    PhaseCounter counter;
    gpu::enqueue_span(counter, view, plan, Span{stage, stage}, [](Stage) {});
    phases[static_cast<std::size_t>(stage)] = counter.phases();
  }
  return phases;
}

}  // namespace cutproof::benchmarks
