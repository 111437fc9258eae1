#include <gtest/gtest.h>

#include "gpu/host_launcher.h"

namespace cutproof::gpu {
namespace {

template <class Block>
CUTPROOF_DEVICE void sum_kernel(Block& block, const int* in, int count, int* out) {
  for (int job = block.index(); job < count; job += block.count()) {
    int own = 0;
    for (int i = block.thread(); i < 100; i += block.size()) own += in[job * 100 + i];
    const int total = block.sum(own);
    block.sync();
    if (block.thread() == 0) out[job] = total;
  }
}
CUTPROOF_KERNEL(sum_kernel);

TEST(Launch, SumsInBlocks) {
  std::vector<int> in(100 * 1000, 1), out(1000);
  for (const int threads : {1, 3}) {
    HostLauncher launcher(HostLauncher::Threads{threads});
    launcher.blocks(sum_kernel_object{}, 1000, 128, 0, in.data(), 1000, out.data());
    for (int v : out) ASSERT_EQ(v, 100);
  }
  HostLauncher launcher(HostLauncher::Simulated{.schedule = random_walk(1)});
  launcher.blocks(sum_kernel_object{}, 1000, 128, 0, in.data(), 1000, out.data());
}

}  // namespace
}  // namespace cutproof::gpu
