// One step on the reference and on each backend that runs the kernels here.
#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "gpu/backends.h"
#include "model/setup.h"
#include "model/state.h"
#include "reference_cpu/reference.h"

namespace cutproof::tests {

struct NamedBackend {
  std::string name;
  std::function<std::unique_ptr<Backend>()> make;
};
inline void PrintTo(const NamedBackend& backend, std::ostream* os) { *os << backend.name; }

inline std::vector<NamedBackend> all_backends() {
  std::vector<NamedBackend> backends = {{"reference", reference::make_backend},
                                        {"host", [] { return gpu::make_host_backend(2, {}); }}};
#if CUTPROOF_HAS_CUDA
  std::string why;
  if (!gpu::device_description(why).empty()) backends.push_back({"gpu", [] { return gpu::make_gpu_backend({}); }});
#endif
  return backends;
}

class EveryBackend : public ::testing::TestWithParam<NamedBackend> {
 protected:
  // Of the frame that the state says.
  State step(const cutproof::Setup& setup, const State& state) const {
    backend_->load({setup}, {state});
    backend_->run({Stage::step, Stage::step});
    return backend_->snapshot().front();
  }
  double tolerance(double in_double, double in_single) const {
    return backend_->precision() == Precision::binary64 ? in_double : in_single;
  }

  std::unique_ptr<Backend> backend_ = GetParam().make();
};

// Greatest distance of two sets of positions [h].
inline double distance(const cutproof::Setup& setup, const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double greatest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double apart = norm(a[i] - b[i]);
    if (!(apart <= greatest)) greatest = apart;  // NaN is greater than everything
  }
  return greatest / setup.body.grid.spacing;
}

}  // namespace cutproof::tests
