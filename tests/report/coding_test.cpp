// What a page holds, taken apart by another reader than the page's own.
#include "report/coding.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

namespace cutproof::report::coding_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

std::string inflated(const std::string& packed) {
  z_stream stream = {};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string text, buffer(1 << 16, '\0');
  int status = Z_OK;
  while (status == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    status = inflate(&stream, Z_NO_FLUSH);
    text.append(buffer.data(), buffer.size() - stream.avail_out);
  }
  EXPECT_EQ(status, Z_STREAM_END);
  inflateEnd(&stream);
  return text;
}

uint32_t byte_at(const std::string& bytes, std::size_t k) { return static_cast<unsigned char>(bytes[k]); }

std::vector<uint16_t> steps_from(const std::string& bytes, const std::vector<uint16_t>& before) {
  const std::size_t n = bytes.size() / 2;
  std::vector<uint16_t> steps;
  uint16_t moved = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const uint32_t code = byte_at(bytes, i) | byte_at(bytes, n + i) << 8;
    moved = static_cast<uint16_t>(moved + (code % 2 == 0 ? code / 2 : ~(code / 2)));
    steps.push_back(static_cast<uint16_t>(moved + (before.empty() ? 0 : before[i])));
  }
  return steps;
}

TEST(Steps, AreOffByNoMoreThanTheStatedLoss) {
  std::mt19937_64 random(1);
  const Box box = {{-0.3, 2, -1e-3}, {0.7, 2.5, 1e-3}};
  std::vector<Vec3> points = {box.low, box.high};
  for (int k = 0; k < 10'000; ++k) {
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = std::uniform_real_distribution<double>(box.low[axis], box.high[axis])(random);
    points.push_back(p);
  }
  const std::vector<uint16_t> steps = steps_of(points, box);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int a = static_cast<int>(axis);
      worst =
          std::max(worst, std::abs(place_of(steps[axis * points.size() + i], box.low[a], box.high[a]) - points[i][a]));
    }
  }
  EXPECT_LE(worst, loss(box) * (1 + 1e-9));
  EXPECT_GT(worst, loss(box) / 2) << "the stated loss is far from the true one";
  EXPECT_NEAR(loss(box), 1.0 / 65534 / 2, 1e-12);
}

TEST(Steps, OfWhatIsNoPlaceAreNowhere) {
  const Box box = {{0, 0, 0}, {1, 1, 1}};
  for (const Vec3 lost : {Vec3{kNan, 0, 0}, Vec3{0, kInf, 0}, Vec3{0, 0, 1.5}, Vec3{-1e-9, 0, 0}})
    EXPECT_EQ(steps_of(std::vector<Vec3>{lost}, box), std::vector<uint16_t>(3, kNowhere));
  EXPECT_EQ(steps_of(std::vector<Vec3>{{0, 1, 0}}, {{0, 1, 0}, {0, 1, 0}}), std::vector<uint16_t>(3, 0))
      << "a box without extent";
}

TEST(Steps, AreTakenBackFromTheirDifferences) {
  std::mt19937_64 random(2);
  std::vector<uint16_t> first, second;
  for (int k = 0; k < 999; ++k) {
    first.push_back(static_cast<uint16_t>(random()));
    second.push_back(static_cast<uint16_t>(random()));
  }
  first[5] = second[6] = kNowhere;
  std::string alone, after;
  append_steps(alone, first, {});
  append_steps(after, second, first);
  EXPECT_EQ(steps_from(alone, {}), first);
  EXPECT_EQ(steps_from(after, first), second);
}

TEST(Integers, AreTakenBackFromTheirDifferences) {
  const std::vector<int32_t> values = {
      0, -1, 5, std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min(), 7};
  std::string bytes = "kept";
  append_integers(bytes, values);
  bytes.erase(0, 4);
  const std::size_t n = values.size();
  ASSERT_EQ(bytes.size(), 4 * n);
  uint32_t last = 0;
  for (std::size_t i = 0; i < n; ++i) {
    uint32_t code = 0;
    for (std::size_t plane = 0; plane < 4; ++plane) code |= byte_at(bytes, plane * n + i) << 8 * plane;
    last += code % 2 == 0 ? code / 2 : ~(code / 2);
    EXPECT_EQ(static_cast<int32_t>(last), values[i]);
  }
}

TEST(Flags, AreEightToAByte) {
  std::string bytes;
  append_flags(bytes, std::vector<uint8_t>{1, 0, 0, 1, 0, 0, 0, 1, 1});
  EXPECT_EQ(bytes, "\x89\x01");
}

TEST(Gzip, IsInflatedToTheSameAndIsTheSameEachTime) {
  std::mt19937_64 random(3);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 20, (std::size_t{3} << 20) + 17}) {
    std::string bytes(size, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    const std::string packed = gzip(bytes);
    EXPECT_EQ(inflated(packed), bytes);
    EXPECT_EQ(gzip(bytes), packed);
  }
}

TEST(Base64, IsThatOfTheStandard) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
}

TEST(ScriptJson, EndsNoElementAndMeansTheSame) {
  const std::string name = "</script><script>window.hacked=1</script><!-- & \u2028\u2029 \xE2\x80\xA7 ü";
  const std::string safe = script_json(nlohmann::json(name).dump());
  for (const char* const word : {"<", ">", "&", "\u2028", "\u2029"})
    EXPECT_EQ(safe.find(word), std::string::npos) << word;
  EXPECT_EQ(nlohmann::json::parse(safe).get<std::string>(), name);
}

}  // namespace
}  // namespace cutproof::report::coding_test
