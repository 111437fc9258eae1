#include "guests/guest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "model/at.h"
#include "model/error.h"
#include "model/printable.h"

extern char** environ;

namespace cutproof::guests {

namespace {

namespace fs = std::filesystem;

// Loading a library and a device's first context.
constexpr double kTimeToStart = 60;

[[noreturn]] void machine_failed(const std::string& what) { throw MachineError(what + ": " + std::strerror(errno)); }

// Beside this program, where it is installed, or where the environment says.
std::string guest_program() {
  if (const char* const named = std::getenv("CUTPROOF_GUEST")) return named;
  std::error_code failed;
  const fs::path here = fs::read_symlink("/proc/self/exe", failed).parent_path();
  for (const fs::path& place : {here / "cutproof-guest", here / "../libexec/cutproof/cutproof-guest"
#ifdef CUTPROOF_GUEST_PROGRAM
                                ,
                                fs::path(CUTPROOF_GUEST_PROGRAM)
#endif
       }) {
    if (fs::exists(place, failed)) return place.string();
  }
  throw MachineError(
      "cutproof-guest, the program that runs plugins, is not beside cutproof; CUTPROOF_GUEST can name it");
}

// True: there is something to read, or the other end is gone.
bool wait_for(int channel, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd waiting = {channel, POLLIN, 0};
    const int found = poll(&waiting, 1, static_cast<int>(std::clamp<int64_t>(left, 0, 1'000'000)));
    if (found > 0) return true;
    if (found < 0 && errno != EINTR) machine_failed("poll");
    if (found == 0 && left <= 1'000'000) return false;
  }
}

int64_t up_to_page(int64_t bytes) { return (bytes + wire::kPage - 1) / wire::kPage * wire::kPage; }

const char* name_of_signal(int signal) {
  const char* const name = sigabbrev_np(signal);
  return name != nullptr ? name : "?";
}

}  // namespace

bool PluginInfo::can_run(Span span) const {
  return offers(wire::run) &&
         (spans >> wire::span_bit(static_cast<int>(span.first), static_cast<int>(span.last)) & 1u) != 0;
}

Argument given(const Array& array) {
  return {array.name, Role::given, array.type, array.rows(), array.columns(), array.bytes.data()};
}

Array in_precision(const Array& array, Precision precision) {
  if (array.type != ElementType::f64 || precision == Precision::binary64) return array;
  const auto wide = array.of<double>();
  return make_array(array.name, array.shape, std::vector<float>(wide.begin(), wide.end()));
}

Guest::Guest(GuestOptions options)
    : options_(std::move(options)),
      request_(std::make_unique<wire::Request>()),
      reply_(std::make_unique<wire::Reply>()) {
  std::error_code failed;
  if (!fs::exists(options_.library, failed)) {
    throw InputError(options_.library, "", "there is no such file", "name the shared library of a plugin");
  }
  if (!fs::is_regular_file(options_.library, failed)) {
    throw InputError(options_.library, "", "this is not a file", "name the shared library of a plugin");
  }
  options_.library = fs::absolute(options_.library).string();
  // Counterexamples and documents name it, and these are UTF-8.
  if (!is_utf8(options_.library)) {
    throw InputError(options_.library, "", "the name of the plugin, or of a folder it lies in, is not UTF-8",
                     "rename it");
  }
  file_.number = memfd_create("cutproof arrays", MFD_CLOEXEC);
  if (file_.number < 0 || ftruncate(file_.number, wire::kMemoryBytes) != 0)
    machine_failed("memory to share with a plugin");
  map();
  start();
}

Guest::Guest(int channel, int memory, double time_limit)
    : request_(std::make_unique<wire::Request>()),
      reply_(std::make_unique<wire::Reply>()),
      attached_(true),
      channel_(channel) {
  file_.number = memory;
  options_.library = "the attached guest";
  options_.time_limit = time_limit;
  const auto refuse = [this](const std::string& problem) {
    throw InputError(options_.library, "--attached", problem, "let cutproof.py start this program");
  };
  int type = 0;
  socklen_t size = sizeof type;
  if (getsockopt(channel, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_SEQPACKET) {
    refuse(fmt::format("file {} is not a socket of separate messages", channel));
  }
  struct stat file = {};
  if (fstat(memory, &file) != 0 || file.st_size != wire::kMemoryBytes) {
    refuse(fmt::format("file {} is not a memory of {} bytes", memory, wire::kMemoryBytes));
  }
  map();
  running_ = true;
  restarts_ = 0;
  greet(kTimeToStart);
}

Guest::~Guest() { stop(); }

void Guest::map() {
  void* const mapped = mmap(nullptr, static_cast<std::size_t>(wire::kMemoryBytes), PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_NORESERVE, file_.number, 0);
  if (mapped == MAP_FAILED) machine_failed("memory to share with a plugin");
  mapping_.at = mapped;
  memory_ = static_cast<unsigned char*>(mapped);
}

Guest::File::~File() {
  if (number >= 0) close(number);
}
Guest::Mapping::~Mapping() {
  if (at != nullptr) munmap(at, static_cast<std::size_t>(wire::kMemoryBytes));
}

void Guest::start() {
  if (attached_) throw MachineError("the guest has ended");
  stop();
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) machine_failed("a channel to a plugin");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // Only this process inherits these two: a file that is copied onto itself stays open in it. If they were open to
  // others for a moment, a guest that another thread starts would hold this guest's end of the channel, and the end of
  // this guest would stay unnoticed.
  const int their_channel = fcntl(ends[1], F_DUPFD_CLOEXEC, 100),
            their_file = fcntl(file_.number, F_DUPFD_CLOEXEC, 100);
  for (const int file : {their_channel, their_file}) posix_spawn_file_actions_adddup2(&actions, file, file);
  const std::string program = guest_program(), channel = std::to_string(their_channel),
                    file = std::to_string(their_file);
  const char* const arguments[] = {program.c_str(), options_.library.c_str(), channel.c_str(), file.c_str(), nullptr};
  const std::string parameters = "CUTPROOF_PLUGIN_PARAMETERS=" + options_.parameters;
  std::vector<const char*> environment;
  for (char** each = environ; *each != nullptr; ++each) {
    if (std::strncmp(*each, "CUTPROOF_PLUGIN_PARAMETERS=", 27) != 0) environment.push_back(*each);
  }
  environment.push_back(parameters.c_str());
  environment.push_back(nullptr);
  // In a group of its own: a terminal's ^C is for the host, which ends in order; a guest that it killed would seem to
  // have crashed. It ends with its host. What the host ignores is not the plugin's choice.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setpgroup(&attributes, 0);
  sigset_t ignored;
  sigemptyset(&ignored);
  sigaddset(&ignored, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &ignored);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  const int failed = posix_spawn(&process_, program.c_str(), &actions, &attributes, const_cast<char**>(arguments),
                                 const_cast<char**>(environment.data()));
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  close(their_channel);
  close(their_file);
  channel_ = ends[0];
  if (failed != 0) {
    process_ = -1;
    throw MachineError(program + ": " + std::strerror(failed));
  }
  running_ = true;
  ++restarts_;
  greet(std::max(kTimeToStart, options_.time_limit));
}

void Guest::greet(double time_limit) {
  const auto hello = std::make_unique<wire::Hello>();
  const std::string remedy =
      attached_ ? "" : "a plugin is a shared library that includes cutproof/plugin.h (docs/reference/plugins.md)";
  const std::string loading = attached_ ? "its greeting" : "loading it";
  std::string problem;
  ssize_t received = 0;
  if (!wait_for(channel_, time_limit)) {
    problem = fmt::format("{} does not end within {:g} s", loading, time_limit);
  } else if (received = recv(channel_, hello.get(), sizeof *hello, MSG_TRUNC); received <= 0) {
    problem = loading + " ends the process: " + why_it_ended();
  }
  if (!problem.empty()) {
    stop();
    throw InputError(options_.library, "", problem, remedy);
  }
  const auto text = [](const char* from) { return printable(from); };
  if (received != static_cast<ssize_t>(sizeof *hello) || hello->protocol != wire::kProtocol ||
      hello->request_bytes != sizeof(wire::Request) || hello->reply_bytes != sizeof(wire::Reply)) {
    stop();
    throw InputError(
        options_.library, "",
        fmt::format("{} is of another version than cutproof", attached_ ? "cutproof.py" : "cutproof-guest"),
        "install both again");
  }
  if (hello->greeting != wire::Greeting::ready) {
    stop();
    if (hello->greeting == wire::Greeting::cannot_run_here) throw CannotRunHere(text(hello->text));
    if (hello->greeting == wire::Greeting::wrong_parameters) {
      throw InputError(options_.library, "parameters", text(hello->text),
                       fmt::format("they are \"{}\"", options_.parameters));
    }
    throw InputError(options_.library, "", text(hello->text), remedy);
  }
  plugin_.name = text(hello->name);
  plugin_.version = text(hello->version);
  plugin_.promises = hello->has_promises != 0 ? std::optional(text(hello->promises)) : std::nullopt;
  plugin_.limits = text(hello->limits);
  plugin_.on_device = hello->device != 0;
  plugin_.operations = hello->operations;
  plugin_.spans = hello->spans;
  if (hello->real != static_cast<int32_t>(ElementType::f32) && hello->real != static_cast<int32_t>(ElementType::f64)) {
    throw InputError(options_.library, "real", fmt::format("{} is not a type of real numbers", hello->real),
                     "use CUTPROOF_F32 or CUTPROOF_F64");
  }
  plugin_.precision = hello->real == static_cast<int32_t>(ElementType::f64) ? Precision::binary64 : Precision::binary32;
}

void Guest::stop() {
  if (channel_ >= 0) {
    close(channel_);
    channel_ = -1;
  }
  if (process_ > 0) {
    // One that waits ends by itself when its channel is closed, and takes its instances apart; it may take as long as
    // for an answer (a sanitizer that it runs under writes its report now).
    int status = 0;
    pid_t ended = 0;
    const auto last = std::chrono::steady_clock::now() + std::chrono::duration<double>(options_.time_limit);
    while (running_ && (ended = waitpid(process_, &status, WNOHANG)) == 0 && std::chrono::steady_clock::now() < last) {
      usleep(1000);
    }
    if (ended == 0) {
      kill(process_, SIGKILL);
      waitpid(process_, &status, 0);
    }
    process_ = -1;
  }
  running_ = false;
}

std::string Guest::describe_fault(const wire::Fault& fault) const {
  const std::string what = fault.access == 2 ? "writes to" : fault.access == 1 ? "reads" : "touches";
  if (fault.array < 0 || at(fault.array) >= request_->array_count) return {};
  const wire::Array& array = request_->arrays[fault.array];
  if (fault.distance < 0) {
    return fmt::format(": it {} byte {} before the beginning of '{}'", what, -fault.distance, array.name);
  }
  if (fault.distance >= fault.bytes) {
    return fmt::format(": it {} byte {} behind the end of '{}', which has {} rows", what,
                       fault.distance - fault.bytes + 1, array.name,
                       fault.bytes / (array.columns * size_of(ElementType{array.type})));
  }
  return fmt::format(": it {} '{}', which is an input", what, array.name);
}

// Of a guest that has ended.
std::string Guest::why_it_ended() {
  if (attached_) return "the guest has closed its channel";
  int status = 0;
  pid_t ended = 0;
  for (int k = 0; k < 2000 && (ended = waitpid(process_, &status, WNOHANG)) == 0; ++k) usleep(1000);
  if (ended == 0) {
    kill(process_, SIGKILL);
    waitpid(process_, &status, 0);
    process_ = -1;
    return "it has closed the channel to its host";
  }
  process_ = -1;
  if (WIFEXITED(status)) return fmt::format("it ended the process with exit status {}", WEXITSTATUS(status));
  wire::Fault fault;
  std::memcpy(&fault, memory_ + wire::kFaultOffset, sizeof fault);
  const int signal = WTERMSIG(status);
  std::string text = fmt::format("it was killed by signal {} (SIG{})", signal, name_of_signal(signal));
  if (fault.signal == signal && (signal == SIGSEGV || signal == SIGBUS)) text += describe_fault(fault);
  return text;
}

std::string Guest::problem_around(const wire::Array& array, int64_t offset, int64_t bytes, int64_t first,
                                  int64_t end) const {
  for (int64_t k = offset - 1; k >= first; --k) {
    if (memory_[k] == wire::kCanary) continue;
    return fmt::format("it wrote to byte {} before the beginning of '{}'", offset - k, array.name);
  }
  for (int64_t k = offset + bytes; k < end; ++k) {
    if (memory_[k] == wire::kCanary) continue;
    return fmt::format("it wrote to byte {} behind the end of '{}', which has {} rows", k - offset - bytes + 1,
                       array.name, bytes / (array.columns * size_of(ElementType{array.type})));
  }
  return {};
}

Answer Guest::call(Operation operation, uint32_t instance, Span span, const std::vector<Argument>& arguments,
                   bool at_end) {
  if (!running_) start();
  wire::Request& request = *request_;
  request.operation = operation;
  request.instance = instance;
  request.first = static_cast<int32_t>(span.first);
  request.last = static_cast<int32_t>(span.last);
  request.at_end = at_end ? 1 : 0;
  if (arguments.size() > std::size_t{wire::kMostArrays}) throw std::logic_error("too many arrays for a plugin");
  request.array_count = static_cast<uint32_t>(arguments.size());
  int64_t next = wire::kLeastGap, arena = 0;
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const Argument& argument = arguments[k];
    wire::Array& array = request.arrays[k];
    array = {};
    std::snprintf(array.name, sizeof array.name, "%s", argument.name.c_str());
    array.type = static_cast<int32_t>(argument.type);
    array.role = argument.role;
    array.rows = argument.rows;
    array.columns = argument.columns;
    array.arena = -1;
    const int64_t bytes = argument.rows * argument.columns * size_of(argument.type);
    if (argument.role == Role::grown) {
      array.arena = arena++;
      if (arena > wire::kArenaCount || bytes > wire::kMostGrown) throw MachineError("too much memory for a plugin");
      const wire::Place place = wire::place_in_arena(array.arena, bytes, at_end);
      array.offset = place.offset;
      array.first_page = place.first_page;
      array.end_page = place.end_page;
    } else {
      array.first_page = next;
      array.end_page = next + up_to_page(bytes);
      array.offset = at_end ? array.end_page - bytes : array.first_page;
      next = array.end_page + up_to_page(std::max(bytes, wire::kLeastGap));
      if (next > wire::kArrayBytes)
        throw MachineError("the arrays of this case need more memory than plugins can share");
    }
    std::memset(memory_ + array.first_page, wire::kCanary, at(array.offset - array.first_page));
    std::memset(memory_ + array.offset + bytes, wire::kCanary, at(array.end_page - array.offset - bytes));
    if (argument.data != nullptr && bytes > 0) std::memcpy(memory_ + array.offset, argument.data, at(bytes));
    // Unwritten values show: NaN, -1, 255.
    if (argument.data == nullptr) std::memset(memory_ + array.offset, 0xff, at(bytes));
  }
  std::memset(memory_ + wire::kFaultOffset, 0, sizeof(wire::Fault));

  Answer answer;
  const auto lost = [&](std::string text) {
    running_ = false;
    stop();
    answer.kind = Answer::Kind::fault;
    answer.text = std::move(text);
    return answer;
  };
  if (send(channel_, &request, sizeof request, MSG_NOSIGNAL) != static_cast<ssize_t>(sizeof request)) {
    return lost(why_it_ended());
  }
  if (!wait_for(channel_, options_.time_limit)) {
    return lost(fmt::format("it did not answer within {:g} s", options_.time_limit));
  }
  wire::Reply& reply = *reply_;
  if (recv(channel_, &reply, sizeof reply, 0) != static_cast<ssize_t>(sizeof reply)) return lost(why_it_ended());
  reply.text[sizeof reply.text - 1] = 0;
  if (reply.outcome == wire::Outcome::device_failed) return lost(printable(reply.text));
  if (reply.outcome == wire::Outcome::broke_a_rule) {
    answer.kind = Answer::Kind::fault;
    answer.text = printable(reply.text);
    return answer;
  }
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const Argument& argument = arguments[k];
    const wire::Array& array = request.arrays[k];
    if (argument.role == Role::given || argument.role == Role::setup) {
      // Pages keep the program in process/ from writing to these; of other guests only the outcome is seen.
      const int64_t bytes = argument.rows * argument.columns * size_of(argument.type);
      if (!attached_) continue;
      std::string problem = problem_around(array, array.offset, bytes, array.first_page, array.end_page);
      if (bytes > 0 && std::memcmp(memory_ + array.offset, argument.data, at(bytes)) != 0) {
        problem = fmt::format("it wrote to '{}', which is an input", argument.name);
      }
      if (problem.empty()) continue;
      answer.kind = Answer::Kind::fault;
      answer.text = std::move(problem);
      answer.arrays.clear();
      return answer;
    }
    const int64_t rows = reply.rows[k], offset = reply.offset[k], row = argument.columns * size_of(argument.type);
    const bool grown = argument.role == Role::grown;
    const bool possible = grown ? rows >= 0 && rows <= wire::kMostGrown / row : rows == argument.rows;
    const int64_t bytes = possible ? rows * row : 0;
    const wire::Place place = grown ? wire::place_in_arena(array.arena, bytes, at_end)
                                    : wire::Place{array.offset, array.first_page, array.end_page};
    if (!possible || offset != place.offset) {
      return lost("its process says something about '" + argument.name + "' that cannot be");
    }
    if (std::string problem = problem_around(array, offset, bytes, place.first_page, place.end_page);
        !problem.empty()) {
      answer.kind = Answer::Kind::fault;
      answer.text = std::move(problem);
      answer.arrays.clear();
      return answer;
    }
    Array got{argument.name, argument.type, {rows, argument.columns}, {}};
    got.bytes.resize(at(bytes));
    if (bytes > 0) std::memcpy(got.bytes.data(), memory_ + offset, at(bytes));
    answer.arrays.push_back(std::move(got));
  }
  // A guest that refuses has not written out of bounds either.
  if (reply.outcome == wire::Outcome::refused) {
    answer.kind = Answer::Kind::refused;
    answer.text = fmt::format("it refused, with {}", reply.code);
    answer.arrays.clear();
  }
  return answer;
}

}  // namespace cutproof::guests
