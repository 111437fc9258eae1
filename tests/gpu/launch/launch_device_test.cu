// launch_checks.h on the device, as a graph and at once.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "gpu/device/cuda_check.h"
#include "gpu/device/device_launcher.cuh"
#include "tests/gpu/launch/launch_checks.h"

namespace cutproof::gpu {
namespace {

template <class T>
class DeviceArray {
 public:
  explicit DeviceArray(const std::vector<T>& values) : count_(values.size()) {
    CUTPROOF_CUDA(cudaMalloc(&data_, std::max<std::size_t>(count_, 1) * sizeof(T)));
    CUTPROOF_CUDA(cudaMemcpy(data_, values.data(), count_ * sizeof(T), cudaMemcpyHostToDevice));
  }
  ~DeviceArray() { static_cast<void>(cudaFree(data_)); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;
  T* at() const { return data_; }
  std::vector<T> get() const {
    std::vector<T> values(count_);
    CUTPROOF_CUDA(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost));
    return values;
  }

 private:
  T* data_ = nullptr;
  std::size_t count_;
};

struct DeviceMachine {
  bool as_graph;

  template <class T>
  DeviceArray<T> array(const std::vector<T>& values) {
    return DeviceArray<T>(values);
  }
  template <class Work>
  void run(Work work) {
    if (as_graph) {
      const DeviceGraph graph = DeviceLauncher::capture(work);
      graph.launch(nullptr);
      CUTPROOF_CUDA(cudaStreamSynchronize(nullptr));
    } else {
      DeviceLauncher launcher(nullptr);
      work(launcher);
      CUTPROOF_CUDA(cudaStreamSynchronize(nullptr));
    }
  }
  std::vector<int> block_sizes() const { return {32, 64, 128, 256, 512, 1024}; }
};

class LaunchOnDevice : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    int devices = 0;
    const cudaError_t status = cudaGetDeviceCount(&devices);
    if (status != cudaSuccess || devices == 0) {
      GTEST_SKIP() << "gpu was not run: no device (" << cudaGetErrorString(status) << ")";
    }
  }
  DeviceMachine machine{GetParam()};
};

TEST_P(LaunchOnDevice, VisitsEveryItemOnce) { check_every_item_is_visited_once(machine); }
TEST_P(LaunchOnDevice, GivesEveryJobOneBlock) { check_every_job_gets_one_block(machine); }
TEST_P(LaunchOnDevice, CollectivesAreWhatTheySay) { check_collectives(machine); }
TEST_P(LaunchOnDevice, WarpOperationsAreWhatTheySay) { check_warp_operations(machine); }
TEST_P(LaunchOnDevice, TeamsAreWhatTheySay) { check_teams(machine); }
TEST_P(LaunchOnDevice, AtomicsLoseNothing) { check_atomics(machine); }
TEST_P(LaunchOnDevice, SharedMemoryIsAlignedAndDisjoint) { check_shared_memory(machine); }
TEST_P(LaunchOnDevice, ConditionsAreReadWhenTheWorkBeforeIsDone) { check_conditions(machine); }
TEST_P(LaunchOnDevice, ScansAnyNumberOfItems) { check_scan(machine); }
TEST_P(LaunchOnDevice, SelectsFlaggedIndicesInOrder) { check_select(machine); }
TEST_P(LaunchOnDevice, SortsAndDropsDuplicates) { check_sort_unique(machine); }
TEST_P(LaunchOnDevice, ClearsWhatItIsGiven) { check_clear(machine); }
TEST_P(LaunchOnDevice, RunsPiecesSideBySide) { check_side_by_side(machine); }
TEST_P(LaunchOnDevice, RunsPiecesBehindOthers) { check_pieces_behind(machine); }

INSTANTIATE_TEST_SUITE_P(Modes, LaunchOnDevice, testing::Bool(),
                         [](const auto& info) { return info.param ? "Graph" : "AtOnce"; });

TEST_P(LaunchOnDevice, AGraphCanBeLaunchedAgain) {
  auto sum = machine.array(std::vector<int>{0});
  auto flag = machine.array(std::vector<int>{0});
  const DeviceGraph graph = DeviceLauncher::capture([&](DeviceLauncher& launcher) {
    launcher.items(set_kernel_object{}, 1, flag.at(), 4);
    launcher.while_nonzero(flag.at(), [&](DeviceLauncher& inside) {
      inside.items(add_kernel_object{}, 1, sum.at(), 1);
      inside.items(add_kernel_object{}, 1, flag.at(), -1);
    });
  });
  for (int i = 0; i < 100; ++i) graph.launch(nullptr);
  EXPECT_EQ(sum.get()[0], 400);
}

TEST_P(LaunchOnDevice, FailuresOfCudaNameTheCall) {
  try {
    CUTPROOF_CUDA(cudaMemcpy(nullptr, nullptr, 16, cudaMemcpyDeviceToHost));
    FAIL() << "nothing was thrown";
  } catch (const MachineError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("cudaMemcpy(nullptr"), std::string::npos) << text;
    EXPECT_NE(text.find("launch_device_test.cu"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace cutproof::gpu
