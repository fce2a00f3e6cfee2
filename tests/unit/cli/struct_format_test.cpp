// Expected bytes and values are those of Python 3.11's struct module.
#include "cli/text/struct_format.hpp"

#include <gtest/gtest.h>

#include "cli/text/hex.hpp"

namespace swarmtalk::cli {
namespace {

using Strings = std::vector<std::string>;

std::string packed(std::string_view format, const Strings& words) {
  std::string problem;
  const auto parsed = StructFormat::parse(format, problem);
  if (!parsed) return problem;
  const auto bytes = parsed->pack(words, problem);
  return bytes ? to_hex(*bytes) : problem;
}

std::string unpacked(std::string_view format, std::string_view hex) {
  std::string problem;
  const auto parsed = StructFormat::parse(format, problem);
  if (!parsed) return problem;
  const auto values = parsed->unpack(*from_hex(hex));
  if (!values) return "another size";
  std::string text;
  for (const auto& value : *values) text += (text.empty() ? "" : " ") + to_text(value);
  return text;
}

TEST(StructFormat, AFloatAndADoubleAreToldWithAllTheirDigits) {
  EXPECT_EQ(to_text(StructFormat::Value(0.1)), "0.1");
  EXPECT_EQ(to_text(StructFormat::Value(static_cast<double>(0.1F))), "0.1");
  EXPECT_EQ(to_text(StructFormat::Value(1.0 / 3)), "0.3333333333333333");
  EXPECT_EQ(to_text(StructFormat::Value(1e300)), "1e+300");
}

TEST(StructFormat, PacksAsPythonDoes) {
  EXPECT_EQ(packed("<HfB", {"1000", "2.5", "0x1f"}), "e803000020401f");
  EXPECT_EQ(packed(">bhiq", {"-1", "-2", "-3", "-4"}), "fffffefffffffdfffffffffffffffc");
  EXPECT_EQ(packed("!3B2x?", {"1", "2", "3", "true"}), "010203000001");
  EXPECT_EQ(packed("<5sc", {"abc", "z"}), "61626300007a");
  EXPECT_EQ(packed("<ed", {"0.1", "0.1"}), "662e9a9999999999b93f");
  EXPECT_EQ(packed("<2e", {"65504", "6e-8"}), "ff7b0100");
  EXPECT_EQ(packed("", {}), "it has no values");
}

TEST(StructFormat, AlignsWithoutAnOrderAsACompilerDoes) {
  EXPECT_EQ(packed("Bi", {"1", "2"}), "0100000002000000");
  EXPECT_EQ(packed("=Bi", {"1", "2"}), "0102000000");
}

TEST(StructFormat, UnpacksWhatWasPacked) {
  EXPECT_EQ(unpacked("<HfB", "e803000020401f"), "1000 2.5 31");
  EXPECT_EQ(unpacked(">bhiq", "fffffefffffffdfffffffffffffffc"), "-1 -2 -3 -4");
  EXPECT_EQ(unpacked("<5sc?", "61626300007a01"), "\"abc\" \"z\" true");
  EXPECT_EQ(unpacked("<2e", "662e00fc"), "0.099975586 -inf");
  EXPECT_EQ(unpacked("<Q", "ffffffffffffffff"), "18446744073709551615");
  EXPECT_EQ(unpacked("<H", "00"), "another size");
}

TEST(StructFormat, SaysWhatIsWrongWithAFormat) {
  EXPECT_EQ(packed("<Hk", {}),
            "it has 'k'; the letters are xcbB?hHiIlLqQefds, and nN without < > ! =");
  EXPECT_EQ(packed("3", {}), "a count needs a letter after it");
  EXPECT_EQ(packed("99999999999999999999B", {}), "it has more than 65536 bytes");
  EXPECT_EQ(packed("60000s60000s", {}), "it has more than 65536 bytes");
}

TEST(StructFormat, SaysWhichValueDoesNotFit) {
  EXPECT_EQ(packed("<B", {"256"}), "'256' is not a value for the letter B of format <B");
  EXPECT_EQ(packed("<b", {"-129"}), "'-129' is not a value for the letter b of format <b");
  EXPECT_EQ(packed("<I", {"-1"}), "'-1' is not a value for the letter I of format <I");
  EXPECT_EQ(packed("<H", {"1.5"}), "'1.5' is not a value for the letter H of format <H");
  EXPECT_EQ(packed("<f", {"1e39"}), "'1e39' is not a value for the letter f of format <f");
  EXPECT_EQ(packed("<e", {"65520"}), "'65520' is not a value for the letter e of format <e");
  EXPECT_EQ(packed("<2s", {"abc"}), "'abc' is not a value for the letter s of format <2s");
  EXPECT_EQ(packed("<2B", {"1"}), "format <2B takes 2 values, not 1");
}

}  // namespace
}  // namespace swarmtalk::cli
