// cutproof-guest LIBRARY SOCKET MEMORY: the process in which a plugin lives. Loads it, answers requests
// (wire.h) one after the other, and dies with it. Nothing but the C library is linked, so nothing here stands in the
// way of what the plugin brings along.
#include <dlfcn.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "cutproof/plugin.h"
#include "guests/process/device.h"
#include "guests/wire.h"

namespace {

using namespace cutproof::guests;
using wire::Role;

int channel = -1;
unsigned char* memory = nullptr;

template <std::size_t n>
void put(char (&to)[n], const std::string& text) {
  std::snprintf(to, n, "%s", text.c_str());
}

// --- Arrays ----------------------------------------------------------------------------------------------------------

int64_t size_of(int32_t type) { return type == CUTPROOF_U8 ? 1 : type == CUTPROOF_I32 || type == CUTPROOF_F32 ? 4 : 8; }
int64_t up_to_page(int64_t offset) { return (offset + wire::kPage - 1) / wire::kPage * wire::kPage; }

// An array of the request in progress.
struct Held {
  wire::Array wire = {};
  cutproof_array shown = {};  // the plugin's copy, which it may change
  cutproof_array right = {};  // the host's values
  int64_t offset = 0;         // of its bytes in memory, on the host
  DeviceArray device;
  int64_t bytes() const { return right.rows * right.columns * size_of(right.type); }
};

struct Call {
  wire::Request request = {};
  std::vector<Held> arrays;
  std::string broken;  // the first rule that was broken
  bool device_failed = false;
  Held* find(const char* name, bool setup = false) {
    for (Held& held : arrays) {
      if ((held.wire.role == Role::setup) == setup && std::strcmp(held.wire.name, name) == 0) return &held;
    }
    return nullptr;
  }
  cutproof_array* shown(const char* name) {
    Held* const held = find(name);
    return held == nullptr ? nullptr : &held->shown;
  }
};

Call call;
const cutproof_plugin* plugin = nullptr;
bool on_device = false;
std::map<uint32_t, void*> instances;
// Pages that may be touched, for the next call to close: of the arrays all before this, of each arena [first, end).
int64_t opened_arrays = 0;
int64_t opened_arenas[wire::kArenaCount][2] = {};

// --- What kills the guest --------------------------------------------------------------------------------------------

void on_fault(int signal, siginfo_t* info, [[maybe_unused]] void* context) {
  auto* const fault = reinterpret_cast<wire::Fault*>(memory + wire::kFaultOffset);
  *fault = {signal, 0, -1, 0, 0};
  // The array that is nearest, if any is as near as arrays are to each other.
  const auto* const touched = static_cast<const unsigned char*>(info->si_addr);
  int64_t least = wire::kLeastGap;
  for (std::size_t k = 0; touched >= memory && touched < memory + wire::kMemoryBytes && k < call.arrays.size(); ++k) {
    const Held& held = call.arrays[k];
    const int64_t distance = touched - (memory + held.offset), bytes = held.bytes();
    const int64_t outside = distance < 0 ? -distance : std::max<int64_t>(distance - bytes + 1, 0);
    if (outside >= std::max(least, bytes)) continue;
    least = outside;
    fault->array = static_cast<int32_t>(k);
    fault->distance = distance;
    fault->bytes = bytes;
  }
#if defined(__x86_64__)
  if (signal == SIGSEGV || signal == SIGBUS) {
    fault->access = (static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_ERR] & 2) != 0 ? 2 : 1;
  }
#endif
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void catch_faults() {
  static unsigned char stack[64 * 1024];
  stack_t alternate = {};
  alternate.ss_sp = stack;
  alternate.ss_size = sizeof stack;
  sigaltstack(&alternate, nullptr);
  struct sigaction action = {};
  action.sa_sigaction = on_fault;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_NODEFER;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigaction(signal, &action, nullptr);
}

void open_pages(int64_t first, int64_t end, int protection) {
  if (end <= first) return;
  if (mprotect(memory + first, static_cast<std::size_t>(end - first), protection) != 0) {
    std::perror("cutproof-guest: mprotect");
    std::_Exit(3);
  }
}

void close_all() {
  open_pages(0, up_to_page(opened_arrays), PROT_NONE);
  opened_arrays = 0;
  for (auto& [first, end] : opened_arenas) {
    open_pages(first, end, PROT_NONE);
    first = end = 0;
  }
}

wire::Place place_in_arena(int64_t arena, int64_t bytes) {
  return wire::place_in_arena(arena, bytes, call.request.at_end != 0);
}

void fill_slack(const wire::Place& place, int64_t bytes) {
  std::memset(memory + place.first_page, wire::kCanary, static_cast<std::size_t>(place.offset - place.first_page));
  std::memset(memory + place.offset + bytes, wire::kCanary,
              static_cast<std::size_t>(place.end_page - place.offset - bytes));
}

void show(Held& held) {
  held.right.data =
      on_device && held.wire.role != Role::setup ? held.device.data() : static_cast<void*>(memory + held.offset);
  held.shown = held.right;
}

// Opens the array's pages, and fills them where its length is the guest's to say.
void take(Held& held) {
  const wire::Array& array = held.wire;
  held.right = {sizeof(cutproof_array),
                array.type,
                on_device && array.role != Role::setup ? CUTPROOF_CUDA : CUTPROOF_HOST,
                0,
                array.rows,
                array.columns,
                nullptr};
  held.offset = array.offset;
  if (array.role == Role::grown) {
    open_pages(array.first_page, array.end_page, PROT_READ | PROT_WRITE);
    opened_arenas[array.arena][0] = array.first_page;
    opened_arenas[array.arena][1] = array.end_page;
  } else {
    const bool written = array.role == Role::answer;
    open_pages(array.first_page, array.end_page, written ? PROT_READ | PROT_WRITE : PROT_READ);
    opened_arrays = std::max(opened_arrays, array.end_page);
  }
  if (on_device && array.role != Role::setup) {
    if (!held.device.make(memory + held.offset, held.bytes())) call.device_failed = true;
  }
  show(held);
}

int grow(const cutproof_host*, cutproof_array* output, int64_t rows) {
  const auto break_rule = [](const std::string& what) {
    if (call.broken.empty()) call.broken = what;
    return 1;
  };
  Held* held = nullptr;
  for (Held& each : call.arrays) {
    if (&each.shown == output) held = &each;
  }
  if (held == nullptr) return break_rule("grow() was given an array that is not one of the operation's");
  const std::string name = held->wire.name;
  if (held->wire.role != Role::grown) return break_rule("grow() was given '" + name + "', whose length is fixed");
  const int64_t row = held->right.columns * size_of(held->right.type);
  const int64_t most = wire::kMostGrown / row;
  if (rows < 0 || rows > most) {
    return break_rule("grow() was asked for " + std::to_string(rows) + " rows of '" + name + "'; possible are 0 to " +
                      std::to_string(most));
  }
  const int64_t old_bytes = held->bytes(), bytes = rows * row;
  if (on_device) {
    if (!held->device.grow(bytes, old_bytes)) {
      call.device_failed = true;
      return 1;
    }
    held->right.rows = rows;
    show(*held);
    return 0;
  }
  const wire::Place place = place_in_arena(held->wire.arena, bytes);
  auto& [first, end] = opened_arenas[held->wire.arena];
  // All that was and all that will be there, while bytes move.
  open_pages(std::min(first, place.first_page), std::max(end, place.end_page), PROT_READ | PROT_WRITE);
  std::memmove(memory + place.offset, memory + held->offset, static_cast<std::size_t>(std::min(old_bytes, bytes)));
  if (bytes > old_bytes) {
    std::memset(memory + place.offset + old_bytes, 0xff, static_cast<std::size_t>(bytes - old_bytes));
  }
  open_pages(std::min(first, place.first_page), place.first_page, PROT_NONE);
  open_pages(place.end_page, std::max(end, place.end_page), PROT_NONE);
  first = place.first_page;
  end = place.end_page;
  fill_slack(place, bytes);
  held->offset = place.offset;
  held->right.rows = rows;
  show(*held);
  return 0;
}

void write_log(const cutproof_host*, const char* text) { std::fprintf(stderr, "plugin: %s\n", text); }

const cutproof_array* setup_of(const cutproof_host*, const char* name) {
  Held* const held = call.find(name, true);
  return held == nullptr ? nullptr : &held->shown;
}

std::string wrong_parameters;
void refuse_parameters(const cutproof_host*, const char* text) { wrong_parameters = text; }

cutproof_host host = {sizeof(cutproof_host), CUTPROOF_ABI, nullptr, nullptr, grow, write_log, setup_of,
                      refuse_parameters};

// --- Operations ------------------------------------------------------------------------------------------------------

template <class T>
T host_value(const char* name, int64_t index, T otherwise) {
  const Held* const held = call.find(name, true);
  if (held == nullptr) return otherwise;
  T value;
  std::memcpy(&value, memory + held->offset + index * static_cast<int64_t>(sizeof(T)), sizeof(T));
  return value;
}

cutproof_tissue tissue() {
  cutproof_tissue t = {};
  t.size = sizeof t;
  t.edge_offsets = call.shown("edge_offsets");
  t.edge_ends = call.shown("edge_ends");
  t.rest = call.shown("rest");
  t.mass = call.shown("mass");
  t.node = call.shown("node");
  t.spacing = host_value("spacing", 0, 0.0);
  for (int axis = 0; axis < 3; ++axis) t.nodes[axis] = host_value("nodes", axis, int32_t{0});
  return t;
}

cutproof_state state() {
  cutproof_state s = {};
  s.size = sizeof s;
  s.frame = call.shown("state/frame");
  s.tau = call.shown("state/tau");
  s.cap = call.shown("state/cap");
  s.edge_covered = call.shown("state/edge_covered");
  s.impulse = call.shown("state/impulse");
  s.position = call.shown("state/position");
  s.velocity = call.shown("state/velocity");
  s.alive = call.shown("state/alive");
  s.removed = call.shown("state/removed");
  s.debris = call.shown("state/debris");
  s.offsets = call.shown("state/offsets");
  s.members = call.shown("state/members");
  s.number = call.shown("state/number");
  s.rest_center = call.shown("state/rest_center");
  s.mass = call.shown("state/mass");
  s.rotation = call.shown("state/rotation");
  s.degenerate = call.shown("state/degenerate");
  s.owner = call.shown("state/owner");
  s.direction = call.shown("state/direction");
  s.skin_position = call.shown("state/skin_position");
  s.triangles = call.shown("state/triangles");
  s.reach = call.shown("state/reach");
  return s;
}

cutproof_scene scene(const cutproof_tissue& tissue) {
  cutproof_scene s = {};
  s.size = sizeof s;
  s.tissue = &tissue;
  s.velocity = call.shown("velocity");
  s.held = call.shown("held");
  s.tetrahedra = call.shown("tetrahedra");
  s.hexahedra = call.shown("hexahedra");
  s.blade = call.shown("blade");
  s.blades = host_value("blades", 0, int32_t{0});
  if (s.blade != nullptr && s.blades > 0) s.frames = static_cast<int32_t>(s.blade->rows / s.blades);
  s.frame_time = host_value("frame_time", 0, 0.0);
  s.kick = call.shown("kick");
  s.kick_frame = host_value("kick_frame", 0, int32_t{-1});
  for (int axis = 0; axis < 3; ++axis) s.gravity[axis] = host_value("gravity", axis, 0.0);
  return s;
}

cutproof_frames run() {
  cutproof_frames r = {};
  r.size = sizeof r;
  r.steps = call.shown("run/steps");
  r.damping = call.shown("run/damping");
  r.particles = call.shown("run/particles");
  r.position = call.shown("run/position");
  r.velocity = call.shown("run/velocity");
  r.spin = call.shown("run/spin");
  r.mass = call.shown("run/mass");
  r.alive = call.shown("run/alive");
  r.parent = call.shown("run/parent");
  r.contact_impulse = call.shown("run/contact_impulse");
  r.energy = call.shown("run/energy");
  r.group_count = call.shown("run/group_count");
  r.offsets = call.shown("run/offsets");
  r.members = call.shown("run/members");
  r.weights = call.shown("run/weights");
  r.cell_count = call.shown("run/cell_count");
  r.tetrahedra = call.shown("run/tetrahedra");
  r.hexahedra = call.shown("run/hexahedra");
  r.seconds = call.shown("run/seconds");
  return r;
}

// A member of the plugin, which an older header does not have.
#define OF_PLUGIN(member) (CUTPROOF_HAS(plugin, member) ? plugin->member : nullptr)

bool instance(uint32_t number, void*& self) {
  const auto known = instances.find(number);
  if (known != instances.end()) {
    self = known->second;
    return true;
  }
  self = nullptr;
  if (OF_PLUGIN(create) != nullptr) {
    self = plugin->create(&host, std::getenv("CUTPROOF_PLUGIN_PARAMETERS"));
    if (self == nullptr) return false;
  }
  instances[number] = self;
  return true;
}

int ask(void* self) {
  const cutproof_tissue t = tissue();
  cutproof_state s = state();
  switch (call.request.operation) {
    case wire::rotations:
      return plugin->rotations(&host, self, call.shown("a"), call.shown("previous"), call.shown("r"));
    case wire::components:
      return plugin->components(&host, self, &t, call.shown("alive"), call.shown("label"));
    case wire::surface:
      return plugin->surface(&host, self, &t, call.shown("alive"), call.shown("vertices"), call.shown("triangles"));
    case wire::clusters:
      return plugin->clusters(&host, self, &t, call.shown("offsets"), call.shown("members"));
    case wire::load:
      return plugin->load(&host, self, &t, &s);
    case wire::run:
      return plugin->run(&host, self, call.request.first, call.request.last, &s);
    case wire::dissect: {
      const cutproof_scene asked = scene(t);
      cutproof_frames r = run();
      return plugin->dissect(&host, self, &asked, &r);
    }
    default:
      return -1;
  }
}

// Fields that the plugin must not change.
void check_descriptions() {
  for (const Held& held : call.arrays) {
    const cutproof_array &shown = held.shown, &right = held.right;
    const std::string name = held.wire.name;
    if (!call.broken.empty()) return;
    if (shown.rows != right.rows) {
      call.broken = "it says that '" + name + "' has " + std::to_string(shown.rows) + " rows, but " +
                    std::to_string(right.rows) + " were given" +
                    (held.wire.role == Role::grown ? " by grow()" : std::string());
    } else if (shown.data != right.data) {
      call.broken = "it put memory of its own into '" + name + "', where only grow() changes what data is";
    } else if (shown.columns != right.columns || shown.type != right.type || shown.device != right.device ||
               shown.size != right.size) {
      call.broken = "it changed what '" + name + "' is: columns, type, device and size are the host's";
    }
  }
}

void answer(wire::Reply& reply) {
  close_all();
  call.arrays.clear();
  call.broken.clear();
  call.device_failed = false;
  call.arrays.resize(call.request.array_count);
  for (uint32_t k = 0; k < call.request.array_count; ++k) {
    call.arrays[k].wire = call.request.arrays[k];
    take(call.arrays[k]);
  }
  // The plugin's stream does not wait for what brought its arrays there.
  std::string problem_before;
  if (on_device && !call.device_failed && !wait_for_device(problem_before)) {
    call.device_failed = true;
    call.broken = problem_before;
  }
  void* self = nullptr;
  if (!instance(call.request.instance, self)) {
    call.broken = "create() returned nothing, although an earlier call returned an object";
  } else if (!call.device_failed) {
    reply.code = ask(self);
    if (reply.code != 0) reply.outcome = wire::Outcome::refused;
    check_descriptions();
  }
  if (on_device && !call.device_failed) {
    std::string problem;
    if (!wait_for_device(problem)) {
      call.device_failed = true;
      call.broken = problem;
    }
    for (Held& held : call.arrays) {
      if (held.wire.role == Role::setup || call.device_failed || !call.broken.empty()) continue;
      const int64_t bytes = held.bytes();
      if (held.wire.role == Role::grown) {
        const wire::Place place = place_in_arena(held.wire.arena, bytes);
        open_pages(place.first_page, place.end_page, PROT_READ | PROT_WRITE);
        opened_arenas[held.wire.arena][0] = std::min(place.first_page, opened_arenas[held.wire.arena][0]);
        opened_arenas[held.wire.arena][1] = std::max(place.end_page, opened_arenas[held.wire.arena][1]);
        fill_slack(place, bytes);
        held.offset = place.offset;
      }
      const std::string wrong = held.device.bring_back(memory + held.offset, bytes, held.wire.role == Role::given);
      if (!wrong.empty()) call.broken = "'" + std::string(held.wire.name) + "': " + wrong;
    }
  }
  for (uint32_t k = 0; k < call.request.array_count; ++k) {
    reply.rows[k] = call.arrays[k].right.rows;
    reply.offset[k] = call.arrays[k].offset;
    call.arrays[k].device.free();
  }
  if (call.device_failed) {
    reply.outcome = wire::Outcome::device_failed;
    if (call.broken.empty()) call.broken = device_problem();
  } else if (!call.broken.empty()) {
    reply.outcome = wire::Outcome::broke_a_rule;
  }
  put(reply.text, call.broken);
}

// --- Start -----------------------------------------------------------------------------------------------------------

// A plugin that hangs does not outlive its host. (Linux sends its signal of a parent's death when the thread ends that
// started the process, but campaigns hand guests from thread to thread.) A guest that waits for a request sees the end
// of the channel itself, and destroys its instances then.
void end_with_host() {
  std::thread([] {
    pollfd hung_up = {channel, 0, 0};
    while (poll(&hung_up, 1, -1) < 0 && errno == EINTR) {
    }
    sleep(2);
    std::_Exit(0);
  }).detach();
}

// So that a plugin of the host finds what it writes on standard output, and tables stay tables.
void send_output_to_error() { dup2(2, 1); }

void greet(wire::Hello& hello, const char* library) {
  hello.protocol = wire::kProtocol;
  hello.memory = reinterpret_cast<uint64_t>(memory);
  hello.remembers_faults = 1;
  hello.request_bytes = sizeof(wire::Request);
  hello.reply_bytes = sizeof(wire::Reply);
  void* const loaded = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  if (loaded == nullptr) {
    hello.greeting = wire::Greeting::cannot_load;
    return put(hello.text, dlerror());
  }
  using Entry = const cutproof_plugin* (*)(uint32_t);
  const auto entry = reinterpret_cast<Entry>(dlsym(loaded, "cutproof_plugin_entry"));
  if (entry == nullptr) {
    hello.greeting = wire::Greeting::no_entry;
    return put(hello.text, "it exports no function cutproof_plugin_entry");
  }
  plugin = entry(CUTPROOF_ABI);
  if (plugin == nullptr || plugin->abi != CUTPROOF_ABI) {
    hello.greeting = wire::Greeting::wrong_abi;
    return put(hello.text, plugin == nullptr
                               ? "it has nothing for version " + std::to_string(CUTPROOF_ABI)
                               : "it was made for version " + std::to_string(plugin->abi) +
                                     " of plugin.h, and this cutproof has " + std::to_string(CUTPROOF_ABI));
  }
  if (plugin->size < offsetof(cutproof_plugin, create)) {
    hello.greeting = wire::Greeting::wrong_abi;
    return put(hello.text, "it says that its struct has " + std::to_string(plugin->size) +
                               " bytes: size is to be sizeof(cutproof_plugin)");
  }
  put(hello.name, plugin->name != nullptr ? plugin->name : "");
  put(hello.version, plugin->version != nullptr ? plugin->version : "");
  hello.has_promises = plugin->promises != nullptr;
  put(hello.promises, plugin->promises != nullptr ? plugin->promises : "");
  const char* const limits = OF_PLUGIN(limits);
  put(hello.limits, limits != nullptr ? limits : "");
  hello.device = plugin->device;
  hello.real = plugin->real == 0 ? static_cast<int32_t>(CUTPROOF_F32) : plugin->real;
  const auto offers = [&](wire::Operation operation, bool there) {
    if (there) hello.operations |= 1u << operation;
  };
  offers(wire::rotations, OF_PLUGIN(rotations) != nullptr);
  offers(wire::components, OF_PLUGIN(components) != nullptr);
  offers(wire::surface, OF_PLUGIN(surface) != nullptr);
  offers(wire::clusters, OF_PLUGIN(clusters) != nullptr);
  offers(wire::load, OF_PLUGIN(load) != nullptr);
  offers(wire::run, OF_PLUGIN(run) != nullptr);
  offers(wire::dissect, OF_PLUGIN(dissect) != nullptr);
  for (int first = 0; first < 6; ++first) {
    for (int last = first; last < 6; ++last) {
      if (OF_PLUGIN(can_run) != nullptr && plugin->can_run(first, last) == 0) continue;
      hello.spans |= 1u << wire::span_bit(first, last);
    }
  }
  on_device = plugin->device == CUTPROOF_CUDA;
  if (on_device) {
    std::string problem;
    if (!open_device(problem)) {
      hello.greeting = wire::Greeting::cannot_run_here;
      return put(hello.text, problem);
    }
    host.stream = device_stream();
  }
  void* self = nullptr;
  if (!instance(0, self)) {
    const bool is_refused = !wrong_parameters.empty();
    hello.greeting = is_refused ? wire::Greeting::wrong_parameters : wire::Greeting::cannot_run_here;
    put(hello.text, is_refused ? wrong_parameters : "its create() returned nothing: it cannot run here");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("cutproof starts cutproof-guest: do not call it directly\n", stderr);
    return 2;
  }
  const rlimit none = {0, 0};
  setrlimit(RLIMIT_CORE, &none);
  channel = std::atoi(argv[2]);
  end_with_host();
  const int file = std::atoi(argv[3]);
  void* const mapped =
      mmap(nullptr, static_cast<std::size_t>(wire::kMemoryBytes), PROT_NONE, MAP_SHARED | MAP_NORESERVE, file, 0);
  if (mapped == MAP_FAILED) {
    std::perror("cutproof-guest: mmap");
    return 3;
  }
  memory = static_cast<unsigned char*>(mapped);
  open_pages(wire::kFaultOffset, wire::kMemoryBytes, PROT_READ | PROT_WRITE);
  send_output_to_error();
  catch_faults();
  static wire::Hello hello;
  greet(hello, argv[1]);
  if (send(channel, &hello, sizeof hello, MSG_NOSIGNAL) != sizeof hello) return 3;
  if (hello.greeting != wire::Greeting::ready) return 0;
  catch_faults();  // a library that was loaded may have installed others
  static wire::Reply reply;
  while (recv(channel, &call.request, sizeof call.request, 0) == static_cast<ssize_t>(sizeof call.request)) {
    reply = {};
    answer(reply);
    if (send(channel, &reply, sizeof reply, MSG_NOSIGNAL) != sizeof reply) return 3;
  }
  for (const auto& [number, self] : instances) {
    if (OF_PLUGIN(destroy) != nullptr && self != nullptr) plugin->destroy(self);
  }
  return 0;
}
