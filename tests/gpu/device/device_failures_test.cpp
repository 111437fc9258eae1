// Each CUDA call of the backend `gpu` fails in turn on a small scene. The calls are taken over when this program is
// linked (--wrap, see CMakeLists.txt), so what is tested is the library as it is.
#include <cuda_runtime_api.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/device_limits.h"
#include "fixtures/build.h"
#include "gpu/backends.h"
#include "gpu/state/staging.h"
#include "model/error.h"
#include "model/io/scene_io.h"

namespace {

enum class Failing {
  once,     // one call is refused, as cudaMalloc is when memory is short
  for_good  // every call from one on reports an error, as all do after a kernel has failed; giving back still works
};

// What stands between the library and CUDA. Calls are counted from 1.
struct Interceptor {
  uint64_t fail_at = 0;  // 0: none fails
  Failing failing = Failing::once;
  uint64_t made = 0;
  const char* failed = nullptr;                    // the first call that was made to fail
  cudaError_t pending = cudaSuccess;               // what cudaGetLastError has not given out yet
  std::vector<const char*> trace;                  // the calls that were made
  std::map<const void*, const char*> outstanding;  // what was handed out and not given back, and by which call
  std::set<cudaStream_t> own_captures;             // streams whose capture will end in a graph that is ours to destroy

  bool counting = false;  // not while things are given back

  void start(uint64_t at, Failing how) {
    counting = true;
    fail_at = at;
    failing = how;
    made = 0;
    failed = nullptr;
    pending = cudaSuccess;
    trace.clear();
  }
  void stop() { counting = false; }
  bool lost() const { return failed != nullptr && failing == Failing::for_good; }
};
Interceptor calls;

// `<<< >>>`, a launch with attributes, and one whose blocks meet.
const std::set<std::string>& launches() {
  static const std::set<std::string> names = {"__cudaLaunchKernel", "cudaLaunchKernelExC",
                                              "cudaLaunchCooperativeKernel"};
  return names;
}

cudaError_t error_of(const std::string& call) {
  if (call.starts_with("cudaMalloc") || call == "cudaGraphInstantiate") return cudaErrorMemoryAllocation;
  if (launches().count(call) != 0) return cudaErrorLaunchOutOfResources;
  return cudaErrorLaunchFailure;
}

// The error that the call `name` is to report, or cudaSuccess.
cudaError_t injected(const char* name) {
  if (!calls.counting) return calls.lost() ? error_of(calls.failed) : cudaSuccess;
  ++calls.made;
  calls.trace.push_back(name);
  if (calls.fail_at == 0 || calls.made < calls.fail_at) return cudaSuccess;
  if (calls.failing == Failing::once && calls.made > calls.fail_at) return cudaSuccess;
  if (calls.failed == nullptr) calls.failed = name;
  return calls.pending = error_of(calls.failed);
}

template <class Call>
cudaError_t call_or_fail(const char* name, Call call) {
  const cudaError_t error = injected(name);
  return error != cudaSuccess ? error : call();
}
// Of a call that hands out *handle.
template <class Handle, class Call>
cudaError_t hand_out(const char* name, Handle* handle, Call call) {
  const cudaError_t error = call_or_fail(name, call);
  if (error == cudaSuccess) calls.outstanding[*handle] = name;
  return error;
}
// Giving back is always carried out.
template <class Call>
cudaError_t give_back(const void* handle, Call call) {
  calls.outstanding.erase(handle);
  const cudaError_t error = call();
  return calls.lost() ? error_of(calls.failed) : error;
}

}  // namespace

// NAME (PARAMETERS) fails in its turn; ARGUMENTS are the names of the parameters.
#define INTERCEPT(name, parameters, arguments)                           \
  extern "C" cudaError_t __real_##name parameters;                       \
  extern "C" cudaError_t __wrap_##name parameters;                       \
  cudaError_t __wrap_##name parameters {                                 \
    return call_or_fail(#name, [&] { return __real_##name arguments; }); \
  }
// A wait that reports a failure has waited all the same.
#define INTERCEPT_WAIT(name, parameters, arguments)   \
  extern "C" cudaError_t __real_##name parameters;    \
  extern "C" cudaError_t __wrap_##name parameters;    \
  cudaError_t __wrap_##name parameters {              \
    const cudaError_t error = injected(#name);        \
    const cudaError_t real = __real_##name arguments; \
    return error != cudaSuccess ? error : real;       \
  }
#define INTERCEPT_HAND_OUT(name, parameters, arguments, handle)              \
  extern "C" cudaError_t __real_##name parameters;                           \
  extern "C" cudaError_t __wrap_##name parameters;                           \
  cudaError_t __wrap_##name parameters {                                     \
    return hand_out(#name, handle, [&] { return __real_##name arguments; }); \
  }
#define INTERCEPT_GIVE_BACK(name, parameter, handle)                 \
  extern "C" cudaError_t __real_##name(parameter handle);            \
  extern "C" cudaError_t __wrap_##name(parameter handle);            \
  cudaError_t __wrap_##name(parameter handle) {                      \
    return give_back(handle, [&] { return __real_##name(handle); }); \
  }

INTERCEPT_HAND_OUT(cudaMalloc, (void** memory, size_t bytes), (memory, bytes), memory)
INTERCEPT_HAND_OUT(cudaMallocManaged, (void** memory, size_t bytes, unsigned flags), (memory, bytes, flags), memory)
INTERCEPT_HAND_OUT(cudaMallocHost, (void** memory, size_t bytes), (memory, bytes), memory)
INTERCEPT_HAND_OUT(cudaStreamCreateWithFlags, (cudaStream_t * stream, unsigned flags), (stream, flags), stream)
INTERCEPT_HAND_OUT(cudaEventCreate, (cudaEvent_t * event), (event), event)
INTERCEPT_HAND_OUT(cudaGraphInstantiate, (cudaGraphExec_t * executable, cudaGraph_t graph, unsigned long long flags),
                   (executable, graph, flags), executable)
INTERCEPT_GIVE_BACK(cudaFree, void*, memory)
INTERCEPT_GIVE_BACK(cudaFreeHost, void*, memory)
INTERCEPT_GIVE_BACK(cudaStreamDestroy, cudaStream_t, stream)
INTERCEPT_GIVE_BACK(cudaEventDestroy, cudaEvent_t, event)
INTERCEPT_GIVE_BACK(cudaGraphDestroy, cudaGraph_t, graph)
INTERCEPT_GIVE_BACK(cudaGraphExecDestroy, cudaGraphExec_t, executable)

INTERCEPT(cudaGetDeviceCount, (int* count), (count))
INTERCEPT(cudaGetDevice, (int* device), (device))
INTERCEPT(cudaSetDevice, (int device), (device))
INTERCEPT(cudaGetDeviceProperties, (cudaDeviceProp * properties, int device), (properties, device))
INTERCEPT(cudaDeviceGetAttribute, (int* value, cudaDeviceAttr attribute, int device), (value, attribute, device))
INTERCEPT_WAIT(cudaDeviceSynchronize, (), ())
INTERCEPT(cudaFuncGetAttributes, (cudaFuncAttributes * attributes, const void* function), (attributes, function))
INTERCEPT(cudaFuncSetAttribute, (const void* function, cudaFuncAttribute attribute, int value),
          (function, attribute, value))
INTERCEPT(cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags,
          (int* blocks, const void* function, int threads, size_t shared_bytes, unsigned flags),
          (blocks, function, threads, shared_bytes, flags))
INTERCEPT(cudaEventElapsedTime, (float* milliseconds, cudaEvent_t begin, cudaEvent_t end), (milliseconds, begin, end))
INTERCEPT(cudaEventRecord, (cudaEvent_t event, cudaStream_t stream), (event, stream))
INTERCEPT_WAIT(cudaEventSynchronize, (cudaEvent_t event), (event))
INTERCEPT_WAIT(cudaStreamSynchronize, (cudaStream_t stream), (stream))
INTERCEPT(cudaMemGetInfo, (size_t * free, size_t* all), (free, all))
INTERCEPT(cudaMemAdvise, (const void* memory, size_t bytes, cudaMemoryAdvise advice, cudaMemLocation place),
          (memory, bytes, advice, place))
INTERCEPT(cudaMemPrefetchAsync,
          (const void* memory, size_t bytes, cudaMemLocation place, unsigned flags, cudaStream_t stream),
          (memory, bytes, place, flags, stream))
INTERCEPT(cudaMemcpy, (void* to, const void* from, size_t bytes, cudaMemcpyKind kind), (to, from, bytes, kind))
INTERCEPT(cudaMemcpyAsync, (void* to, const void* from, size_t bytes, cudaMemcpyKind kind, cudaStream_t stream),
          (to, from, bytes, kind, stream))
INTERCEPT(cudaMemset, (void* data, int value, size_t bytes), (data, value, bytes))
INTERCEPT(cudaMemsetAsync, (void* data, int value, size_t bytes, cudaStream_t stream), (data, value, bytes, stream))
INTERCEPT(cudaGraphLaunch, (cudaGraphExec_t executable, cudaStream_t stream), (executable, stream))
INTERCEPT(cudaGraphConditionalHandleCreate,
          (cudaGraphConditionalHandle * handle, cudaGraph_t graph, unsigned value, unsigned flags),
          (handle, graph, value, flags))
INTERCEPT(cudaGraphAddNode,
          (cudaGraphNode_t * node, cudaGraph_t graph, const cudaGraphNode_t* dependencies,
           const cudaGraphEdgeData* edges, size_t count, cudaGraphNodeParams* parameters),
          (node, graph, dependencies, edges, count, parameters))
INTERCEPT(cudaStreamGetCaptureInfo,
          (cudaStream_t stream, cudaStreamCaptureStatus* status, unsigned long long* id, cudaGraph_t* graph,
           const cudaGraphNode_t** dependencies, const cudaGraphEdgeData** edges, size_t* count),
          (stream, status, id, graph, dependencies, edges, count))
INTERCEPT(cudaStreamUpdateCaptureDependencies,
          (cudaStream_t stream, cudaGraphNode_t* dependencies, const cudaGraphEdgeData* edges, size_t count,
           unsigned flags),
          (stream, dependencies, edges, count, flags))
INTERCEPT(cudaStreamBeginCaptureToGraph,
          (cudaStream_t stream, cudaGraph_t graph, const cudaGraphNode_t* dependencies, const cudaGraphEdgeData* edges,
           size_t count, cudaStreamCaptureMode mode),
          (stream, graph, dependencies, edges, count, mode))
INTERCEPT(cudaLaunchKernelExC, (const cudaLaunchConfig_t* config, const void* kernel, void** arguments),
          (config, kernel, arguments))
INTERCEPT(cudaLaunchCooperativeKernel,
          (const void* kernel, dim3 grid, dim3 block, void** arguments, size_t shared_bytes, cudaStream_t stream),
          (kernel, grid, block, arguments, shared_bytes, stream))
// What <<< >>> becomes. It reports nothing itself: the error is for cudaGetLastError.
INTERCEPT(__cudaLaunchKernel,
          (cudaKernel_t kernel, dim3 grid, dim3 block, void** arguments, size_t shared_bytes, cudaStream_t stream),
          (kernel, grid, block, arguments, shared_bytes, stream))

extern "C" {
cudaError_t __real_cudaGetLastError();
cudaError_t __real_cudaPeekAtLastError();
cudaError_t __real_cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode mode);
cudaError_t __real_cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph);

cudaError_t __wrap_cudaPeekAtLastError() {
  return calls.pending != cudaSuccess ? calls.pending : __real_cudaPeekAtLastError();
}
cudaError_t __wrap_cudaGetLastError() {
  const cudaError_t real = __real_cudaGetLastError();
  if (calls.pending == cudaSuccess) return real;
  return calls.failing == Failing::for_good ? calls.pending : std::exchange(calls.pending, cudaSuccess);
}
cudaError_t __wrap_cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode mode) {
  const cudaError_t error =
      call_or_fail("cudaStreamBeginCapture", [&] { return __real_cudaStreamBeginCapture(stream, mode); });
  if (error == cudaSuccess) calls.own_captures.insert(stream);
  return error;
}
// A capture is over also when its end fails; then there is no graph.
cudaError_t __wrap_cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  const cudaError_t error = injected("cudaStreamEndCapture");
  const cudaError_t real = __real_cudaStreamEndCapture(stream, graph);
  const bool own = calls.own_captures.erase(stream) != 0;
  if (error != cudaSuccess) {
    if (own && *graph != nullptr) static_cast<void>(__real_cudaGraphDestroy(*graph));
    *graph = nullptr;
    return error;
  }
  if (own && *graph != nullptr) calls.outstanding[*graph] = "cudaStreamEndCapture";
  return real;
}
}

namespace cutproof::gpu {
namespace {

constexpr Span kFrame{Stage::step, Stage::skin};
// So little that the backend enlarges its arrays once after the first frames.
constexpr Capacity kLittle{1.0 / 16};

// 120 particles in clusters of one node grown by one, cut in two.
constexpr const char* kScene = R"({"version": 5, "name": "small",
  "body": {"shape": {"kind": "box", "size": [0.06, 0.05, 0.04]}, "spacing": 0.01},
  "clusters": {"method": "boxes", "side": 1}, "frame": {"settle": 0.048},
  "step": {"acceleration": "none"}, "detect": {"criterion": "geometric"}, "ground": {"friction": 0.5},
  "blade": {"speed": 1, "strokes": [{"points": [[0.45, 0.5, 1.3], [0.45, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

const fixtures::Built& small_body() {
  static const fixtures::Built built = fixtures::build(io::parse_scene(kScene, "the test's scene"), "the test's scene");
  return built;
}

KernelOptions options(Path path) {
  KernelOptions options;
  options.path = path;
  options.capacity = kLittle;
  options.fill = 0x5a;  // nothing may hang on what memory held before
  return options;
}

// What a launcher or CUB asks around a launch. As with the launches, a message names the kernel or CUB's function.
const std::set<std::string>& asked_around_a_launch() {
  static const std::set<std::string> names = {
      "cudaGetDevice",         "cudaSetDevice",        "cudaDeviceGetAttribute",
      "cudaFuncGetAttributes", "cudaFuncSetAttribute", "cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags"};
  return names;
}
bool named_by_kernel(const std::string& call) {
  return launches().count(call) != 0 || asked_around_a_launch().count(call) != 0;
}

struct Done {
  State state;
  StepWork work;  // of the step that was run alone
  friend bool operator==(const Done&, const Done&) = default;
};

// All that a backend does: enlarges its arrays by the way, and runs whole frames and stages one by one.
Done load_and_run(Backend& backend) {
  const fixtures::Built& built = small_body();
  Done done;
  backend.load({built.setup}, {built.state});
  for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) {
    if (frame != 1) {
      backend.run(kFrame);
      continue;
    }
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      if (stage == Stage::step) done.work = dynamic_cast<const KernelBackend&>(backend).step_work();
    }
  }
  static_cast<void>(backend.report());
  done.state = backend.snapshot().front();
  return done;
}

std::string setting(const char* name, const std::string& otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

class DeviceFailures : public testing::Test {
 protected:
  void SetUp() override {
    int devices = 0;
    const cudaError_t status = __real_cudaGetDeviceCount(&devices);
    if (status != cudaSuccess || devices == 0) {
      GTEST_SKIP() << "gpu was not run: no device (" << cudaGetErrorString(status) << ")";
    }
    seed_ = std::stoull(setting("CUTPROOF_SEED", std::to_string(std::random_device{}())));
  }

  // Which calls to fail: the first and the last of each name, and one from each of `parts` equal parts of the rest.
  // CUTPROOF_CALLS=all: every one.
  std::vector<uint64_t> chosen(const std::vector<const char*>& trace, uint64_t parts) const {
    const uint64_t most = trace.size();
    if (setting("CUTPROOF_CALLS", "") == "all") parts = most;
    parts = std::min(parts, most);
    std::set<uint64_t> numbers;
    std::map<std::string, uint64_t> last;
    for (uint64_t k = 0; k < most; ++k) {
      if (last.count(trace[k]) == 0) numbers.insert(k + 1);
      last[trace[k]] = k + 1;
    }
    for (const auto& [name, number] : last) numbers.insert(number);
    std::mt19937_64 random(seed_);
    for (uint64_t part = 0; part < parts; ++part) {
      const uint64_t from = part * most / parts, to = (part + 1) * most / parts;
      numbers.insert(1 + from + random() % (to - from));
    }
    return {numbers.begin(), numbers.end()};
  }

  static void expect_nothing_outstanding() {
    for (const auto& [handle, name] : calls.outstanding) ADD_FAILURE() << "what " << name << " gave is lost";
    calls.outstanding.clear();
    EXPECT_EQ(__real_cudaGetLastError(), cudaSuccess);
  }

  // Whether a message says which call failed. A failed launch, and what CUB calls, is named by the kernel's name or by
  // that of CUB's function.
  static bool names(const std::string& message, const std::string& call) {
    if (call == "cudaGetDeviceCount") return message.find("cudaGetDeviceCount says: ") != std::string::npos;
    const std::size_t in = message.find(") in ");
    if (!message.starts_with("CUDA failed: ") || in == std::string::npos) return false;
    const std::string where = message.substr(in);
    if (where.find(call + "(") != std::string::npos) return true;
    return named_by_kernel(call) &&
           (where.find("kernel") != std::string::npos || where.find("cub::") != std::string::npos);
  }

  // Does `work` with call `number` failing; it has to end in a MachineError that names the call. What CUB asks of the
  // device it may also do without: then the state has to be the right one.
  static void fail(uint64_t number, Failing failing, const std::function<bool()>& work_is_right) {
    calls.start(number, failing);
    std::string defect;
    try {
      const bool right = work_is_right();
      const std::string call = calls.failed == nullptr ? "" : calls.failed;
      const bool may_do_without = asked_around_a_launch().count(call) != 0;
      if (!right || !may_do_without) defect = "its failure was not noticed";
    } catch (const MachineError& error) {
      if (calls.failed == nullptr || !names(error.what(), calls.failed)) defect = error.what();
    } catch (const std::exception& error) {
      defect = std::string("not a MachineError but ") + error.what();
    }
    EXPECT_EQ(defect, "") << "call " << number << ", " << (calls.failed == nullptr ? "not reached" : calls.failed);
    calls.start(0, Failing::once);
    calls.stop();
  }

  // Each of the chosen calls fails; afterwards nothing is left, and now and then a fresh backend is tried.
  void fail_each(Path path, Failing failing, uint64_t parts) {
    const auto work = [&] {
      KernelOptions with = options(path);
      if (on_demand_) with.on_demand = *on_demand_;
      const std::unique_ptr<Backend> backend = make_gpu_backend(with);
      Done done = load_and_run(*backend);
      calls.stop();
      return done;
    };
    const Done right = work();  // also fills what CUB and the runtime keep for the process
    calls.start(0, failing);
    ASSERT_TRUE(work() == right) << "two runs differ";
    const std::vector<const char*> trace = made_ = calls.trace;
    expect_nothing_outstanding();

    const std::vector<uint64_t> numbers = chosen(trace, parts);
    const std::size_t every = std::max<std::size_t>(1, numbers.size() / 20);
    const auto& result = *testing::UnitTest::GetInstance()->current_test_info()->result();
    for (std::size_t k = 0; k < numbers.size() && result.total_part_count() < 20; ++k) {
      SCOPED_TRACE("seed " + std::to_string(seed_));
      fail(numbers[k], failing, [&] { return work() == right; });
      expect_nothing_outstanding();
      if (k % every != 0 && k + 1 != numbers.size()) continue;
      EXPECT_TRUE(work() == right) << "after call " << numbers[k] << ", " << trace[numbers[k] - 1];
      expect_nothing_outstanding();
    }
    std::cout << numbers.size() << " of " << trace.size() << " calls failed, seed " << seed_ << std::endl;
  }

  uint64_t seed_ = 0;
  std::optional<OnDemand> on_demand_;  // as KernelOptions has it
  std::vector<const char*> made_;      // all calls of what fail_each() lets fail
};

TEST_F(DeviceFailures, TheSceneMakesTheBackendEnlarge) {
  const fixtures::Built& built = small_body();
  const auto wants = [&](double factor) {
    StagingBuffers staging = make_staging_buffers({built.setup}, {built.state}, Capacity{factor});
    return wants_capacity(staging.view(), staging.counters.front());
  };
  EXPECT_TRUE(wants(kLittle.factor));
  EXPECT_FALSE(wants(2 * kLittle.factor));
  const auto memories = [](Capacity capacity) {
    KernelOptions with;
    with.capacity = capacity;
    calls.start(0, Failing::once);
    static_cast<void>(load_and_run(*make_gpu_backend(with)));
    return std::count(calls.trace.begin(), calls.trace.end(), std::string("cudaMalloc"));
  };
  EXPECT_GT(memories(kLittle), memories(Capacity{}) * 3 / 2);
  expect_nothing_outstanding();
}

TEST_F(DeviceFailures, ACallThatFailsInTheGraphModeLeavesNothing) { fail_each(Path::graph, Failing::once, 300); }

TEST_F(DeviceFailures, ADeviceThatIsLostInTheGraphModeLeavesNothing) { fail_each(Path::graph, Failing::for_good, 100); }

TEST_F(DeviceFailures, ACallThatFailsInTheEagerModeLeavesNothing) { fail_each(Path::eager, Failing::once, 60); }

TEST_F(DeviceFailures, ADeviceThatIsLostInTheEagerModeLeavesNothing) { fail_each(Path::eager, Failing::for_good, 20); }

TEST_F(DeviceFailures, ACallThatFailsWithMemoryOnDemandLeavesNothing) {
  on_demand_ = {1, 0};
  fail_each(Path::graph, Failing::once, 60);
  EXPECT_GT(std::count(made_.begin(), made_.end(), std::string("cudaMallocManaged")), 20);
  fail_each(Path::graph, Failing::for_good, 20);
}

TEST_F(DeviceFailures, ABackendWhoseCallFailedCanBeLoadedAnew) {
  for (const Path path : {Path::graph, Path::eager}) {
    const Done right = load_and_run(*make_gpu_backend(options(path)));
    std::unique_ptr<Backend> backend = make_gpu_backend(options(path));
    static_cast<void>(load_and_run(*backend));  // makes what it keeps from load to load
    calls.start(0, Failing::once);
    static_cast<void>(load_and_run(*backend));
    calls.stop();
    const std::vector<const char*> trace = calls.trace;
    for (const uint64_t number : chosen(trace, 0)) {
      SCOPED_TRACE("call " + std::to_string(number) + ", " + trace[number - 1] + ", path " +
                   std::to_string(static_cast<int>(path)));
      // Graphs are captured only once a load, so a backend that has run makes the same calls as the first time.
      fail(number, Failing::once, [&] { return load_and_run(*backend) == right; });
      ASSERT_TRUE(load_and_run(*backend) == right);
    }
    backend.reset();
    expect_nothing_outstanding();
  }
}

// No failure: the work of a step, counted from what is read back, is that of the same kernels on the CPU.
TEST_F(DeviceFailures, WhatAStepDoesWithItsParticlesIsAsOnTheHost) {
  const StepWork host = load_and_run(*make_host_backend()).work;
  EXPECT_GT(host.resolved + host.loose, 0);
  for (const Path path : {Path::graph, Path::eager}) {
    EXPECT_EQ(load_and_run(*make_gpu_backend(options(path))).work, host) << static_cast<int>(path);
  }
}

// Not failures, but here is what counts: arrays that have room for a cut through everything take memory for what is in
// use, and more where a frame needs more.
struct Taken {
  int64_t on_demand, at_once, room;  // [bytes]
};
constexpr const char* kAlone = "What other programs take of the device's memory is counted, too: run this alone.";
Taken taken_by(const Scene& scene) {
  const fixtures::Built built = fixtures::build(scene, "the test's scene");
  const auto bytes = [&](OnDemand on_demand) {
    KernelOptions with;
    with.on_demand = on_demand;
    const std::unique_ptr<Backend> backend = make_gpu_backend(with);
    const int64_t before = device_bytes_in_use();
    backend->load({built.setup}, {built.state});
    for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) backend->run(kFrame);
    static_cast<void>(backend->report());
    const int64_t taken = device_bytes_in_use() - before;
    return std::pair(taken, backend->snapshot().front());
  };
  const OnDemand as_ever = KernelOptions{}.on_demand;
  StagingBuffers contents = make_contents({built.setup}, {built.state}, {});
  const auto room = static_cast<int64_t>(empty_bytes(contents, as_ever.array));
  static_cast<void>(bytes(as_ever));  // what CUDA takes once for all, with the first of a kind
  const auto [on_demand, state] = bytes(as_ever);
  const auto [at_once, same] = bytes({as_ever.array, std::size_t{1} << 60});
  EXPECT_TRUE(state == same);
  const int64_t particles = built.setup.body.particle_count();
  std::cout << fmt::format("{}: {} bytes a particle, {} with all memory at once, of which {} are room", scene.name,
                           on_demand / particles, at_once / particles, room / particles)
            << std::endl;
  return {on_demand, at_once, room};
}

// A body that is cut once needs less than half of its room.
TEST_F(DeviceFailures, ALargeBodyTakesMemoryWhereItIsNeeded) {
  Scene scene = io::parse_scene(kScene, "the test's scene");
  scene.name = "cut once";
  scene.body.spacing = 0;
  scene.body.particles = 1'000'000;
  scene.clusters.side = 5;
  const Taken taken = taken_by(scene);
  EXPECT_LT(taken.on_demand, taken.at_once - taken.room / 2) << kAlone;
}

// One of which every particle touches something has positions of all, and so less that is not needed.
TEST_F(DeviceFailures, ALargeBodyThatIsWhollyResolvedHasTheMemoryThatItNeeds) {
  const Taken taken = taken_by(io::parse_scene(R"({"version": 5, "name": "wholly resolved",
    "body": {"shape": {"kind": "box", "size": [0.7, 0.7, 0.002]}, "spacing": 0.001},
    "clusters": {"method": "boxes", "side": 5}, "frame": {"count": 3}, "detect": {"criterion": "none"},
    "walls": [{"axis": 2, "side": 1, "offset": 0.26, "friction": 0.3},
              {"axis": 2, "side": -1, "offset": 0.74, "friction": 0.3}]})",
                                               "the test's scene"));
  EXPECT_LT(taken.on_demand, taken.at_once) << kAlone;
}

TEST_F(DeviceFailures, LimitsThatCannotBeMeasuredLeaveNothing) {
  calls.start(0, Failing::once);
  const auto measure = [] { return measure_device_limits().chain_seconds > 0 && device_bytes_in_use() > 0; };
  EXPECT_TRUE(measure());
  calls.stop();
  const std::vector<const char*> trace = calls.trace;
  expect_nothing_outstanding();
  for (const uint64_t number : chosen(trace, 0)) {
    fail(number, Failing::once, measure);
    expect_nothing_outstanding();
  }
}

}  // namespace
}  // namespace cutproof::gpu
