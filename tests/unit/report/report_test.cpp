#include "report/report.hpp"

#include <gtest/gtest.h>

#include <random>

namespace swarmtalk::report {
namespace {

std::string hex(std::string_view bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const char each : bytes) {
    const auto byte = static_cast<unsigned char>(each);
    text += {kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return text;
}

Facts some_facts() {
  Facts facts;
  facts.place = Place{-1500, 2000, 16384, 7};
  facts.hears = {{2, 0}, {300, 64}};
  facts.channels = {{0x8001, 1, 2, 95}};
  facts.lost = Losses{1, 2, 3, 70000};
  facts.programs = {{"wander", ""}};
  facts.name = "scout";
  facts.values = {{"battery", "3.91"}, {"state", ""}};
  return facts;
}

TEST(Report, LookIsAsThePageSays) {
  const Look look{60, {7, 258}};
  EXPECT_EQ(hex(encode(look)), "4c013c0200070102");
  EXPECT_EQ(decode_look(encode(look)), look);
}

TEST(Report, ReportIsAsThePageSays) {
  Report report;
  report.round_air_steps = 0x0102;
  report.wanted = {9};
  report.roots = {{1, 0x1234, 2, 5, 60}};
  report.records = {{5, 0, "ab"}, {6, 4, ""}};
  EXPECT_EQ(hex(encode(report)),
            "520101020100090100011234020005"
            "3c"
            "0005000261620006"
            "0400");
  EXPECT_EQ(decode_report(encode(report)), report);
}

TEST(Report, BodyIsAsThePageSays) {
  Facts facts;
  facts.place = Place{-1500, 2000, 16384, 7};
  facts.hears = {{300, 64}};
  EXPECT_EQ(hex(encode_body(facts)),
            "0107fa2407d0400007"
            "0203012c40");
}

TEST(Report, FactsComeBackAsTheyWere) {
  EXPECT_EQ(decode_body(encode_body(some_facts())), some_facts());
  EXPECT_EQ(decode_body(""), Facts{});
}

TEST(Report, ANameThatIsTooLongIsCutAndNotBelieved) {
  Facts facts;
  facts.name = std::string(21, 'x');
  EXPECT_EQ(decode_body(encode_body(facts))->name, std::string(20, 'x'));
  EXPECT_FALSE(decode_body("\x06\x15" + *facts.name));
}

TEST(Report, ValuesAreAsThePageSays) {
  Facts facts;
  facts.values = {{"bat", "3.9"}};
  EXPECT_EQ(hex(encode_body(facts)), "07080362617403332e39");
  EXPECT_FALSE(decode_body(std::string("\x07\x02\x00\x00", 4))) << "a key has at least one byte";
  EXPECT_FALSE(decode_body(std::string("\x07\x04\x01k\x09t", 6))) << "cut";
}

TEST(Report, AsManyValuesAndProgramsAreToldAsThereIsRoomFor) {
  Facts facts = some_facts();
  facts.values.assign(9, {"a key of some length", std::string(kMostValueBytes, 'x')});
  facts.values.push_back({"k", "v"});
  facts.programs = {{std::string(200, 'p'), "short"}};
  const auto back = decode_body(encode_body(facts));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->values.size(), 4u);
  EXPECT_EQ(back->values.back().key, "k");
  EXPECT_EQ(back->programs, (std::vector<std::string>{"short"}));
}

TEST(Report, NoProgramsIsSomethingElseThanNothingSaidOfThem) {
  Facts facts;
  EXPECT_EQ(encode_body(facts), "");
  facts.programs.emplace();
  EXPECT_EQ(hex(encode_body(facts)), "0500");
  EXPECT_EQ(decode_body(encode_body(facts)), facts);
}

TEST(Report, ABodyStaysWithinItsLimit) {
  Facts facts = some_facts();
  facts.hears.resize(60);
  facts.channels.resize(40);
  facts.programs.emplace(40, "a long name of a program");
  const std::string body = encode_body(facts);
  EXPECT_LE(body.size(), kMostBodyBytes);
  const auto back = decode_body(body);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->place, facts.place) << "what matters most comes first";
}

TEST(Report, SectionsOfALaterReleaseAreSkipped) {
  const auto facts = decode_body(std::string("\x63\x02zz", 4) + encode_body(some_facts()));
  EXPECT_EQ(facts, some_facts());
}

TEST(Report, AnotherVersionIsRefused) {
  std::string look = encode(Look{60, {}});
  look[1] = 2;
  EXPECT_FALSE(decode_look(look));
  std::string report = encode(Report{});
  report[1] = 2;
  EXPECT_FALSE(decode_report(report));
}

TEST(Report, EachCutIsRefusedOrIsAnEarlierRecordsEnd) {
  Report report;
  report.roots = {{1, 2, 3, 4, 5}};
  report.records = {{5, 0, encode_body(some_facts())}};
  const std::string bytes = encode(report);
  const std::size_t header = 14;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(decode_report(bytes.substr(0, size)).has_value(), size == header) << size;
  }
}

TEST(Report, NoiseIsReadWithinItsBounds) {
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes(random() % 80, 0);
    for (char& each : bytes) each = static_cast<char>(random());
    if (bytes.size() > 1) bytes[1] = 1;
    if (!bytes.empty()) bytes[0] = random() % 2 != 0 ? 'R' : 'L';
    const auto look = decode_look(bytes);
    EXPECT_TRUE(!look || encode(*look) == bytes);
    const auto report = decode_report(bytes);
    EXPECT_TRUE(!report || encode(*report) == bytes);
    decode_body(bytes);
  }
}

}  // namespace
}  // namespace swarmtalk::report
