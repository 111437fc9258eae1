// The protocol of host and guest: messages of fixed size over a SOCK_SEQPACKET socket, and arrays in memory that both
// map. Guests are the program in process/ and python/cutproof.py, which repeats these layouts.
//
// Memory: kArrayBytes for arrays whose length is known, and behind them kArenaCount arenas of kArenaBytes for outputs
// that the guest makes longer. The file is sparse; only what is touched costs memory. In the guest every page that
// holds no array is out of bounds.
#pragma once
#include <cstdint>
#include <type_traits>

namespace cutproof::guests::wire {

inline constexpr uint32_t kProtocol = 2;
inline constexpr int64_t kPage = 4096;
inline constexpr int64_t kArrayBytes = int64_t{16} << 30;
inline constexpr int64_t kArenaBytes = int64_t{2} << 30;
inline constexpr int64_t kArenaCount = 24;
inline constexpr int64_t kMemoryBytes = kArrayBytes + kArenaCount * kArenaBytes;
// Around arrays lie so many bytes out of bounds, or as many as the array has if these are more.
inline constexpr int64_t kLeastGap = 64 * kPage;
// Bytes around an array on its first and last page.
inline constexpr unsigned char kCanary = 0xc5;
// Device arrays have so many bytes of canary on both sides.
inline constexpr int64_t kDeviceCanary = 4096;

// Bits of Hello::operations: the operations of cutproof/plugin.h.
enum Operation : uint32_t { rotations, components, surface, clusters, load, run, dissect };

enum class Role : int32_t {
  given,   // the guest may only read it
  answer,  // its length is known
  grown,   // the guest says how long it is
  setup    // given, and found by its name through host->setup
};

struct Array {
  char name[40];
  int32_t type;  // ElementType
  Role role;
  int64_t rows, columns;
  int64_t offset;      // of its first byte
  int64_t first_page;  // accessible bytes, a multiple of kPage
  int64_t end_page;
  int64_t arena;  // of a grown one; else -1
};

inline constexpr int kMostArrays = 96;

struct Request {
  uint32_t operation;
  uint32_t instance;    // the plugin's instance that is asked; made when it is first named
  int32_t first, last;  // run
  uint32_t at_end;      // arrays end where their pages end; else they begin where these begin
  uint32_t array_count;
  Array arrays[kMostArrays];
};

enum class Outcome : int32_t {
  answered,
  refused,       // the operation returned Reply::code
  broke_a_rule,  // Reply::text says which; the answer is worth nothing
  device_failed  // the guest is to be restarted
};

struct Reply {
  Outcome outcome;
  int32_t code;
  int64_t rows[kMostArrays];    // of outputs, after the call
  int64_t offset[kMostArrays];  // of their first bytes
  char text[512];
};

enum class Greeting : int32_t {
  ready,
  cannot_load,      // text: why
  no_entry,         // the library exports no plugin
  wrong_abi,        // text: which
  cannot_run_here,  // create() gave nothing, or there is no device; text: why
  wrong_parameters  // text: which
};

// The guest's first message.
struct Hello {
  uint32_t protocol;
  Greeting greeting;
  uint64_t memory;       // where the guest has mapped the arrays
  uint32_t operations;   // bits
  uint32_t spans;        // which can be run, by span_bit
  int32_t device, real;  // as in cutproof_plugin
  int32_t has_promises;
  int32_t remembers_faults;             // it writes a Fault before it dies
  uint32_t request_bytes, reply_bytes;  // sizeof, as the guest knows them
  char name[64], version[64];
  char promises[512];
  char limits[512];  // of dissect
  char text[512];
};

// Stages first .. last as a bit.
constexpr int span_bit(int first, int last) { return first * 6 - first * (first - 1) / 2 + (last - first); }

// Where `bytes` of an arena lie, and the pages that hold them.
struct Place {
  int64_t offset, first_page, end_page;
};
constexpr Place place_in_arena(int64_t arena, int64_t bytes, bool at_end) {
  const int64_t begin = kArrayBytes + arena * kArenaBytes + kLeastGap;
  const int64_t end = begin + kArenaBytes - 2 * kLeastGap;
  if (at_end) return {end - bytes, (end - bytes) / kPage * kPage, end};
  return {begin, begin, (begin + bytes + kPage - 1) / kPage * kPage};
}
// The most that an arena holds.
inline constexpr int64_t kMostGrown = kArenaBytes - 2 * kLeastGap - 2 * kPage;

// Report of a guest that is killed by a signal, in the last page of memory.
struct Fault {
  int32_t signal;
  int32_t access;    // 0: not known, 1: read, 2: write
  int32_t array;     // of the request, the nearest one; -1: none is near
  int64_t distance;  // of the access, from that array's first byte
  int64_t bytes;     // that the array had then
};
inline constexpr int64_t kFaultOffset = kMemoryBytes - kPage;

static_assert(std::is_trivially_copyable_v<Request> && std::is_trivially_copyable_v<Reply> &&
              std::is_trivially_copyable_v<Hello>);

}  // namespace cutproof::guests::wire
