#include "report/harvest_text.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace swarmtalk::report {
namespace {

using Values = std::vector<std::pair<std::string, std::string>>;

bool decode(std::string_view bytes, std::uint32_t question, Values& values) {
  return decode_answer(bytes, question, [&](std::string_view key, std::string_view value) {
    values.emplace_back(key, value);
  });
}

TEST(HarvestText, QuestionIsAsTheManualSays) {
  const std::string bytes = encode({0x01020304, 5, "bat"});
  EXPECT_EQ(bytes, std::string("Q\x01\x02\x03\x04\x05"
                               "bat"));
  const auto question = decode_question(bytes);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->number, 0x01020304u);
  EXPECT_EQ(question->ttl, 5);
  EXPECT_EQ(question->prefix, "bat");
}

TEST(HarvestText, AnswerHoldsItsValues) {
  std::string bytes = begin_answer(7);
  append_value(bytes, "battery", "3.9");
  append_value(bytes, "empty", "");
  append_value(bytes, "long", std::string(512, '\0'));
  Values values;
  EXPECT_TRUE(decode(bytes, 7, values));
  EXPECT_EQ(values, (Values{{"battery", "3.9"}, {"empty", ""}, {"long", std::string(512, '\0')}}));
}

TEST(HarvestText, AnswerToAnotherQuestionIsNone) {
  std::string bytes = begin_answer(7);
  append_value(bytes, "battery", "3.9");
  Values values;
  EXPECT_FALSE(decode(bytes, 8, values));
  EXPECT_TRUE(values.empty());
  EXPECT_FALSE(decode_question(bytes));
}

TEST(HarvestText, CutAnswerGivesWhatIsWhole) {
  std::string bytes = begin_answer(7);
  append_value(bytes, "a", "1");
  const std::size_t whole = bytes.size();
  append_value(bytes, "b", "2");
  for (std::size_t size = whole + 1; size < bytes.size(); ++size) {
    Values values;
    EXPECT_FALSE(decode(bytes.substr(0, size), 7, values)) << size;
    EXPECT_EQ(values, (Values{{"a", "1"}}));
  }
}

TEST(HarvestText, ShortBytesAreNothing) {
  Values values;
  for (const char* bytes : {"", "Q", "Q1234", "A", "A123", "x12345"}) {
    EXPECT_FALSE(decode_question(bytes)) << bytes;
    EXPECT_FALSE(decode(bytes, 0x31323334, values)) << bytes;
  }
}

}  // namespace
}  // namespace swarmtalk::report
