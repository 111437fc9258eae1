// Files of arrays: what numpy and h5py write is read, what we write they read, and what cannot be read is refused.
#include "model/io/array_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>

#include "model/error.h"

namespace cutproof::io::array_file_test {
namespace {

namespace fs = std::filesystem;

class ArrayFiles : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("cutproof.arrays." + std::to_string(getpid()));
    fs::create_directories(folder_);
    ASSERT_EQ(python("write"), 0);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static int python(const std::string& command) {
    const std::string line = "/usr/bin/python3 " CUTPROOF_SOURCE_DIR "/tests/model/array_files.py " + command + " '" +
                             folder_.string() + "'";
    return std::system(line.c_str());
  }
  static std::string path(const std::string& name) { return (folder_ / name).string(); }
  static std::string bytes(const std::string& name) {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static fs::path folder_;
};
fs::path ArrayFiles::folder_;

template <class T>
void expect_array(const ArrayFile& file, const std::string& name, const std::vector<int64_t>& shape,
                  const std::vector<T>& values) {
  const Array* const array = find_array(file.arrays, name);
  ASSERT_NE(array, nullptr) << name;
  EXPECT_EQ(*array, make_array(name, shape, values)) << name << " of " << name_of(array->type);
}

TEST_F(ArrayFiles, OfNumpyAndH5pyAreRead) {
  for (const char* name : {"plain.npz", "deflated.npz", "streamed.npz", "large_numbers.npz", "bytes.npz",
                           "big_endian.npz", "plain.h5", "packed.h5", "list.h5", "matlab.mat"}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(is_array_file(path(name)));
    const ArrayFile file = read_array_file(path(name));
    EXPECT_EQ(file.arrays.size(), 19u);
    expect_array<uint8_t>(file, "truth", {3}, {1, 0, 1});
    expect_array<uint8_t>(file, "int8", {3}, {1, 2, 127});
    expect_array<int32_t>(file, "negative_int8", {3}, {1, -2, -128});
    expect_array<uint8_t>(file, "uint8", {2}, {0, 255});
    expect_array<int32_t>(file, "int16", {2}, {-32768, 32767});
    expect_array<int32_t>(file, "uint16", {2}, {0, 65535});
    expect_array<int32_t>(file, "int32", {1, 2}, {INT32_MIN, INT32_MAX});
    expect_array<int32_t>(file, "uint32", {2}, {0, INT32_MAX});
    expect_array<int64_t>(file, "large_uint32", {2}, {0, 4294967295});
    expect_array<int64_t>(file, "int64", {2}, {INT64_MIN, INT64_MAX});
    expect_array<int64_t>(file, "uint64", {2}, {0, INT64_MAX});
    std::vector<double> twenty_four(24);
    std::iota(twenty_four.begin(), twenty_four.end(), 0.0);
    expect_array<double>(file, "columns", {2, 3, 4}, twenty_four);
    expect_array<int32_t>(file, "table", {2, 3}, {0, 2, 4, 1, 3, 5});
    expect_array<float>(file, "single", {2, 2}, {0.1f, -HUGE_VALF, 1e-45f, 3e38f});
    std::vector<double> sevenths;
    for (int k = 0; k < 24; ++k) sevenths.push_back(k / 7.0);
    expect_array<double>(file, "double", {2, 3, 4}, sevenths);
    expect_array<double>(file, "scalar", {}, {0.1});
    expect_array<int64_t>(file, "whole", {}, {7});
    expect_array<double>(file, "nothing", {0, 3}, {});
    expect_array<double>(file, "column", {3}, {2, 1, 0});
    ASSERT_NE(find_text(file, "promises"), nullptr);
    EXPECT_EQ(*find_text(file, "promises"), "covered connected");
    EXPECT_EQ(find_text(file, "truth"), nullptr);
  }
  const ArrayFile matlab = read_array_file(path("matlab.mat"));
  EXPECT_EQ(matlab.ignored, (std::vector<std::string>{"frame_rate", "long", "nothing", "pairs"}));
  EXPECT_EQ(*find_text(matlab, "author"), "somebody");
  for (const NamedText& text : matlab.texts) EXPECT_EQ(text.is_attribute, text.name == "author") << text.name;
  const ArrayFile versions = read_array_file(path("version_2.npz"));
  expect_array<int32_t>(versions, "a", {2}, {1, 2});
  expect_array<int32_t>(versions, "b", {2}, {1, 2});
}

ArrayFile ours() {
  ArrayFile file;
  file.arrays = {make_array<int32_t>("i32", {2, 3}, {1, -2, 3, 4, 5, 6}),
                 make_array<int64_t>("i64", {1}, {int64_t{1} << 40}),
                 make_array<uint8_t>("u8", {3}, {0, 1, 255}),
                 make_array<float>("f32", {2}, {0.1f, HUGE_VALF}),
                 make_array<double>("f64", {2, 1, 1}, {0.1, -0.0}),
                 make_array<double>("scalar", {}, {2.5}),
                 make_array<double>("none", {0, 3}, {})};
  file.texts = {{"words", "covered connected"}, {"no_words", ""}};
  return file;
}

TEST_F(ArrayFiles, ThatWeWriteAreReadByOthersAndByUs) {
  for (const char* name : {"ours.npz", "ours.h5"}) {
    write_array_file(path(name), ours());
    const ArrayFile back = read_array_file(path(name));
    ASSERT_EQ(back.arrays.size(), ours().arrays.size());
    for (const Array& array : ours().arrays) EXPECT_EQ(*find_array(back.arrays, array.name), array) << array.name;
    for (const NamedText& text : ours().texts) EXPECT_EQ(*find_text(back, text.name), text.text);
  }
  EXPECT_EQ(read_array_file(path("ours.npz")), ours()) << "in order";
  EXPECT_EQ(python("check"), 0);
}

TEST_F(ArrayFiles, OfTheSameContentsAreTheSame) {
  for (const std::string suffix : {".npz", ".h5"}) {
    write_array_file(path("first" + suffix), ours());
    sleep(suffix == ".npz" ? 2 : 0);  // a time stamp in a ZIP archive has two seconds
    write_array_file(path("second" + suffix), ours());
    EXPECT_EQ(bytes("first" + suffix), bytes("second" + suffix));
  }
}

TEST_F(ArrayFiles, ThatCannotBeWrittenLeaveNothingBehind) {
  for (const std::string suffix : {".npz", ".h5"}) {
    EXPECT_THROW(write_array_file(path("nowhere/x" + suffix), ours()), InputError);
    for (const char* name : {"", "a/b"}) {
      ArrayFile file;
      file.arrays = {make_array<double>(name, {}, {1})};
      EXPECT_THROW(write_array_file(path("bad" + suffix), file), std::invalid_argument) << name;
    }
    ArrayFile twice;
    twice.arrays = {make_array<double>("a", {}, {1})};
    twice.texts = {{"a", "b"}};
    EXPECT_THROW(write_array_file(path("bad" + suffix), twice), std::invalid_argument);
    ArrayFile short_one = ours();
    short_one.arrays[0].bytes.pop_back();
    EXPECT_THROW(write_array_file(path("bad" + suffix), short_one), std::invalid_argument);
    EXPECT_FALSE(fs::exists(path("bad" + suffix)));
  }
}

TEST_F(ArrayFiles, ThatCannotBeReadAreRefused) {
  // And by which words, the array's name first where it is one array's fault.
  const std::vector<std::pair<std::string, std::vector<std::string>>> all = {
      {"half.npz", {"x: ", "float16", "float32"}},
      {"half.h5", {"x: ", "float16", "float32"}},
      {"umlaut.mat", {"x: ", "ASCII"}},
      {"block.h5", {"truncated"}},
      {"objects.npz", {"x: ", "Python objects"}},
      {"complex.npz", {"x: ", "<c16"}},
      {"long_double.npz", {"x: ", "<f16"}},
      {"dates.npz", {"x: ", "<M8[D]"}},
      {"structure.npz", {"x: ", "structures"}},
      {"too_large_integer.npz", {"x: ", "9223372036854775808"}},
      {"text_table.npz", {"x: ", "one string"}},
      {"umlaut.npz", {"x: ", "ASCII"}},
      {"long_text.npz", {"x: ", "40000 bytes"}},
      {"many.npz", {"65 arrays, more than 64"}},
      {"axes.npz", {"x: ", "9 axes"}},
      {"cut_off.npz", {"The archive cannot be read"}},
      {"flipped.npz", {"x: ", "damaged"}},
      {"header.npz", {"y: ", "header is not that of the directory"}},
      {"other_name.npz", {"y: ", "header is not that of the directory"}},
      {"directory.npz", {"The archive cannot be read", "directory is damaged"}},
      {"encrypted.npz", {"x.npy: ", "encrypted"}},
      {"outside.npz", {"x: ", "cut off"}},
      {"longer.npz", {"x: ", "after its end"}},
      {"claims_4_gib.npz", {"x.npy: ", "claims 4294967295 bytes"}},
      {"no_size.npz", {"The archive cannot be read", "size is missing"}},
      {"fewer.npz", {"The archive cannot be read", "directory is damaged"}},
      {"far_directory.npz", {"The archive cannot be read", "before its end"}},
      {"inflated_otherwise.npz", {"x: ", "damaged"}},
      {"no_deflation.npz", {"x: ", "damaged"}},
      {"alone.npz", {"neither an NPZ nor an HDF5"}},
      {"empty.npz", {"empty"}},
      {"text.h5", {"neither an NPZ nor an HDF5"}},
      {"folder.npz", {"a/x", "not into folders"}},
      {"no_array.npz", {"readme.txt", ".npy"}},
      {"bzip2.npz", {"x.npy", "compressed"}},
      {"short.npz", {"x: ", "do not fit its shape"}},
      {"long.npz", {"x: ", "do not fit its shape"}},
      {"no_header.npz", {"x: ", "cut off"}},
      {"no_magic.npz", {"x: ", "no array of numpy's"}},
      {"version_3.npz", {"x: ", "version 3.0"}},
      {"nothing_known.npz", {"x: ", "header is damaged"}},
      {"negative.npz", {"x: ", "header is damaged"}},
      {"many_numbers.npz", {"x: ", "do not fit its shape"}},
      {"twice.npz", {"x"}},
      {"claims.npz", {"x.npy", "claims 4000000000 bytes"}},
      {"too_much.npz", {"x.npy", "becomes more than"}},
      {"elsewhere.h5", {"x: ", "link"}},
      {"soft.h5", {"y: ", "link"}},
      {"group.h5", {"a: ", "no dataset"}},
      {"external.h5", {"x: ", "other files"}},
      {"virtual.h5", {"x: ", "other files"}},
      {"unwritten.h5", {"x: ", "24000 bytes, and 0 are stored"}},
      {"huge.h5", {"x: ", "more than 4294967296 bytes"}},
      {"compound.h5", {"x: ", "neither numbers nor text"}},
      {"null.h5", {"x: ", "nothing at all"}},
      {"many.h5", {"more than 64 objects"}},
      {"text_table.h5", {"x: ", "one string"}},
      {"cut_off.h5", {"truncated"}},
      {"nowhere.npz", {"no such file"}},
      {"", {"a folder"}},
  };
  for (const auto& [name, words] : all) {
    SCOPED_TRACE(name);
    try {
      read_array_file(path(name));
      ADD_FAILURE() << "it was read";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_EQ(error.file(), path(name));
      EXPECT_NE(text.find("remedy: "), std::string::npos) << text;
      for (const std::string& word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
    }
  }
}

TEST_F(ArrayFiles, AreToldApartFromRecordings) {
  EXPECT_TRUE(is_array_file("nowhere.npz"));
  EXPECT_FALSE(is_array_file(path("nowhere")));
  EXPECT_FALSE(is_array_file(path("nowhere.cutproof.h5")));
  EXPECT_FALSE(is_array_file(folder_.string()));
  EXPECT_TRUE(is_array_file(path("plain.h5")));
  EXPECT_TRUE(is_array_file(path("text.h5")));
  EXPECT_TRUE(is_array_file(path("cut_off.h5"))) << "whoever reads it says what is wrong";
  fs::copy_file(path("plain.h5"), path("a.cutproof.h5"));
  fs::copy_file(path("plain.h5"), path("a"));
  EXPECT_FALSE(is_array_file(path("a"))) << "there is a recording of that name";
}

}  // namespace
}  // namespace cutproof::io::array_file_test
