// A plugin in a process of its own, asked one operation at a time. Its faults (crashes, hangs, writes out of bounds,
// false statements) come back as answers.
#pragma once
#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "guests/wire.h"
#include "model/arrays.h"
#include "model/precision.h"
#include "model/stage.h"

namespace cutproof::guests {

using wire::Operation;
using wire::Role;

struct GuestOptions {
  std::string library;     // the plugin
  std::string parameters;  // for its create()
  double time_limit = 10;  // [s] for each call
};

// Properties that a plugin states of itself.
struct PluginInfo {
  std::string name, version;
  std::optional<std::string> promises;  // words separated by spaces
  std::string limits;                   // of dissect, likewise
  bool on_device = false;
  Precision precision = Precision::binary32;
  uint32_t operations = 0, spans = 0;  // as in wire::Hello

  bool offers(Operation operation) const { return (operations >> operation & 1u) != 0; }
  bool can_run(Span span) const;
};

// The plugin cannot run on this machine, and says why; the program ends with exit status 77.
class CannotRunHere : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One array of a call. `data`: of one that is given, and what one that is grown begins with.
struct Argument {
  std::string name;
  Role role = Role::given;
  ElementType type = ElementType::f64;
  int64_t rows = 0, columns = 1;
  const void* data = nullptr;
};
Argument given(const Array& array);
// Numbers become those of a plugin's precision.
Array in_precision(const Array& array, Precision precision);

struct Answer {
  enum class Kind { answered, refused, fault };
  Kind kind = Kind::answered;
  std::string text;  // the guest's fault, where it did not answer
  Arrays arrays;     // the answers: the arguments that are outputs, in their order
};

class Guest {
 public:
  // Starts the process and has it load the plugin. Throws InputError, naming the library, if that is no plugin or is
  // made for another version; CannotRunHere; MachineError if no process can be started.
  explicit Guest(GuestOptions options);
  // A guest that runs already and reads from the other end of `channel`; arrays lie in the file `memory` (wire.h). Both
  // numbers are of open files, which become the Guest's. It cannot be restarted (has_ended). Throws InputError if these
  // are no such files, or the guest was made for another version.
  Guest(int channel, int memory, double time_limit);
  ~Guest();
  Guest(const Guest&) = delete;
  Guest& operator=(const Guest&) = delete;

  const PluginInfo& plugin() const { return plugin_; }

  // `at_end`: arrays end where memory that may be touched ends; else they begin where it begins. Asked by turns, both
  // ends are guarded. A lost guest is restarted before the next call, without its instances.
  Answer call(Operation operation, uint32_t instance, Span span, const std::vector<Argument>& arguments, bool at_end);
  // It is gone for good: nothing more can be asked.
  bool has_ended() const { return attached_ && !running_; }
  // Number of restarts.
  int64_t restarts() const { return restarts_; }

 private:
  void start();
  void greet(double time_limit);
  void stop();
  std::string why_it_ended();
  std::string describe_fault(const wire::Fault& fault) const;
  void map();
  std::string problem_around(const wire::Array& array, int64_t offset, int64_t bytes, int64_t first, int64_t end) const;

  // Given back also where a constructor throws.
  struct File {
    int number = -1;
    ~File();
  };
  struct Mapping {
    void* at = nullptr;
    ~Mapping();
  };

  GuestOptions options_;
  PluginInfo plugin_;
  std::unique_ptr<wire::Request> request_;
  std::unique_ptr<wire::Reply> reply_;
  bool attached_ = false, running_ = false;
  File file_;  // of arrays
  Mapping mapping_;
  int channel_ = -1;
  pid_t process_ = -1;
  unsigned char* memory_ = nullptr;
  int64_t restarts_ = -1;
};

}  // namespace cutproof::guests
