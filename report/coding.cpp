#include "report/coding.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>

namespace cutproof::report {

namespace {

// Small differences of either sign become small numbers.
uint16_t folded(uint16_t difference) {
  return static_cast<uint16_t>(difference << 1 ^ (difference & 0x8000u ? 0xFFFFu : 0u));
}
uint32_t folded(uint32_t difference) { return difference << 1 ^ (difference & 0x80000000u ? ~0u : 0u); }

struct Deflating {
  z_stream stream = {};
  Deflating() {
    constexpr int kGzip = 16 + MAX_WBITS, kMemory = 8;
    const int status = deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY);
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    if (status != Z_OK) throw std::logic_error("zlib does not know its own parameters");
  }
  ~Deflating() { deflateEnd(&stream); }
  Deflating(const Deflating&) = delete;
  Deflating& operator=(const Deflating&) = delete;
};

}  // namespace

uint16_t step_of(double x, double low, double high) {
  if (!(x >= low && x <= high)) return kNowhere;  // NaN too
  const double extent = high - low;
  if (!(extent > 0)) return 0;
  return static_cast<uint16_t>(std::lround((x - low) / extent * kMostStep));
}

double place_of(uint16_t step, double low, double high) {
  return low + (high - low) * (static_cast<double>(step) / kMostStep);
}

double loss(const Box& box) {
  const Vec3 size = box.high - box.low;
  return std::max({size.x, size.y, size.z, 0.0}) / kMostStep / 2;
}

std::vector<uint16_t> steps_of(std::span<const Vec3> points, const Box& box) {
  const std::size_t n = points.size();
  std::vector<uint16_t> steps(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    bool is_somewhere = true;
    for (int axis = 0; axis < 3; ++axis) {
      const uint16_t step = step_of(points[i][axis], box.low[axis], box.high[axis]);
      steps[static_cast<std::size_t>(axis) * n + i] = step;
      is_somewhere = is_somewhere && step != kNowhere;
    }
    for (std::size_t axis = 0; axis < 3 && !is_somewhere; ++axis) steps[axis * n + i] = kNowhere;
  }
  return steps;
}

void append_steps(std::string& bytes, std::span<const uint16_t> steps, std::span<const uint16_t> before) {
  const std::size_t first = bytes.size(), n = steps.size();
  bytes.resize(first + 2 * n);
  uint16_t last = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto moved = static_cast<uint16_t>(steps[i] - (before.empty() ? 0 : before[i]));
    const uint16_t code = folded(static_cast<uint16_t>(moved - last));
    bytes[first + i] = static_cast<char>(code & 0xFF);
    bytes[first + n + i] = static_cast<char>(code >> 8);
    last = moved;
  }
}

void append_integers(std::string& bytes, std::span<const int32_t> values) {
  const std::size_t first = bytes.size(), n = values.size();
  bytes.resize(first + 4 * n);
  uint32_t last = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto value = static_cast<uint32_t>(values[i]);
    const uint32_t code = folded(value - last);
    for (std::size_t plane = 0; plane < 4; ++plane)
      bytes[first + plane * n + i] = static_cast<char>(code >> (8 * plane) & 0xFF);
    last = value;
  }
}

void append_flags(std::string& bytes, std::span<const uint8_t> flags) {
  const std::size_t first = bytes.size();
  bytes.resize(first + (flags.size() + 7) / 8, '\0');
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i] != 0) bytes[first + i / 8] = static_cast<char>(bytes[first + i / 8] | 1 << i % 8);
  }
}

std::string gzip(std::string_view bytes) {
  Deflating deflating;
  z_stream& stream = deflating.stream;
  std::string result;
  std::string_view rest = bytes;
  // zlib counts in unsigned int; what goes in at once stays far below its end.
  constexpr std::size_t kAtOnce = std::size_t{1} << 20;
  std::string buffer(kAtOnce, '\0');
  int status = Z_OK;
  do {
    if (stream.avail_in == 0) {
      const std::string_view part = rest.substr(0, kAtOnce);
      rest.remove_prefix(part.size());
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(part.data()));  // zlib reads it only
      stream.avail_in = static_cast<uInt>(part.size());
    }
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    status = deflate(&stream, rest.empty() ? Z_FINISH : Z_NO_FLUSH);
    if (status == Z_STREAM_ERROR) throw std::logic_error("zlib was called in a wrong order");
    result.append(buffer.data(), buffer.size() - stream.avail_out);
  } while (status != Z_STREAM_END);
  return result;
}

std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string script_json(std::string json) {
  // In JSON these stand within texts only, where \u says the same.
  std::string safe;
  safe.reserve(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '<' || c == '>' || c == '&') {
      safe += c == '<' ? "\\u003c" : c == '>' ? "\\u003e" : "\\u0026";
    } else if (json.compare(i, 3, "\xE2\x80\xA8") == 0 || json.compare(i, 3, "\xE2\x80\xA9") == 0) {
      safe += json[i + 2] == '\xA8' ? "\\u2028" : "\\u2029";
      i += 2;
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace cutproof::report
