#include "view/access.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace swarmtalk::view {
namespace {

const AccessRules kRules{8080, "secret-token", {"http://lab:8081"}};

Visitor from_here() {
  Visitor visitor;
  visitor.is_this_machine = true;
  visitor.host = "localhost:8080";
  visitor.target = "/";
  return visitor;
}

Visitor from_elsewhere() {
  Visitor visitor;
  visitor.host = "192.168.7.9:8080";
  visitor.target = "/?token=secret-token";
  return visitor;
}

TEST(Access, ThisMachineIsLetInUnderEachOfItsNames) {
  for (const char* host : {"localhost:8080", "127.0.0.1:8080", "[::1]:8080"}) {
    Visitor visitor = from_here();
    visitor.host = host;
    EXPECT_EQ(refusal(kRules, visitor), "") << host;
  }
}

TEST(Access, APageOfOurOwnIsLetIn) {
  Visitor visitor = from_here();
  visitor.origin = "http://localhost:8080";
  EXPECT_EQ(refusal(kRules, visitor), "");
}

TEST(Access, APageThroughAForwardedPortIsLetIn) {
  for (const std::string host : {"localhost:8081", "127.0.0.1:8081", "[::1]:8081", "localhost"}) {
    Visitor visitor = from_here();
    visitor.host = host;
    EXPECT_EQ(refusal(kRules, visitor), "") << host;
    const std::string own = "http://" + host;
    visitor.origin = own;
    EXPECT_EQ(refusal(kRules, visitor), "") << host;
    visitor.origin = "http://localhost:8080";  // what else the browser has open
    EXPECT_NE(refusal(kRules, visitor), "") << host;
  }
}

TEST(Access, APageFromElsewhereInTheSameBrowserIsRefused) {
  for (const char* origin :
       {"", "http://evil.example", "http://localhost:8081", "https://localhost:8080", "null",
        "http://localhost:80801", "http://localhost"}) {
    Visitor visitor = from_here();
    visitor.origin = origin;
    EXPECT_NE(refusal(kRules, visitor).find("--allow-origin"), std::string::npos) << origin;
  }
}

TEST(Access, AnAllowedOriginIsLetIn) {
  Visitor visitor = from_here();
  visitor.origin = "http://lab:8081";
  EXPECT_EQ(refusal(kRules, visitor), "");
}

TEST(Access, ANameThatWasMadeToPointHereIsRefused) {
  for (const char* host : {"evil.example:8080", "evil.example", "", "localhost:", "xlocalhost:8080",
                           "localhost:8080:8080", "localhost:80x", ":8080"}) {
    Visitor visitor = from_here();
    visitor.host = host;
    EXPECT_NE(refusal(kRules, visitor), "") << host;
  }
}

TEST(Access, ANameThatWasMadeToPointHereIsRefusedWithItsOwnOriginToo) {
  Visitor visitor = from_here();
  visitor.host = "evil.example:8080";
  visitor.origin = "http://evil.example:8080";
  EXPECT_NE(refusal(kRules, visitor), "");
}

TEST(Access, AnotherMachineNeedsTheToken) {
  EXPECT_EQ(refusal(kRules, from_elsewhere()), "");
  Visitor visitor = from_elsewhere();
  for (const char* target : {"/", "/?token=", "/?token=secret-toke", "/?token=secret-token2",
                             "/?xtoken=secret-token", "/?token"}) {
    visitor.target = target;
    EXPECT_NE(refusal(kRules, visitor), "") << target;
  }
}

TEST(Access, TheTokenMayComeAsAnAuthorization) {
  Visitor visitor = from_elsewhere();
  visitor.target = "/";
  visitor.authorization = "Bearer secret-token";
  EXPECT_EQ(refusal(kRules, visitor), "");
}

TEST(Access, WithoutATokenNobodyElseIsLetIn) {
  Visitor visitor = from_elsewhere();
  visitor.target = "/?token=";
  EXPECT_NE(refusal({8080, "", {}}, visitor), "");
}

TEST(Access, AForeignPageThatHasTheTokenIsStillAskedForItsOrigin) {
  Visitor visitor = from_elsewhere();
  visitor.origin = "http://evil.example";
  EXPECT_NE(refusal(kRules, visitor), "");
}

TEST(Access, ParametersAreFoundInAnyOrder) {
  EXPECT_EQ(query_value("/?a=1&token=x&b=2", "token"), "x");
  EXPECT_EQ(query_value("/?token=x=y", "token"), "x=y");
  EXPECT_EQ(query_value("/path", "token"), "");
  EXPECT_EQ(query_value("/?&&&", "token"), "");
}

TEST(Token, IsTheFirstLineOfItsFileOnWhateverSystemThatWasWritten) {
  for (const char* text :
       {"secret-1", "secret-1\n", "secret-1\r\n", "secret-1\nmore\n", "\xEF\xBB\xBFsecret-1\r\n"}) {
    EXPECT_EQ(token_of(text, "t"), "secret-1") << text;
  }
}

TEST(Token, ThatIsNoneIsRefusedWithTheFilesName) {
  const auto problem = [](const std::string& text) {
    try {
      return "taken: " + token_of(text, "a/t");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  std::string wide = "\xFF\xFE";
  for (const char c : std::string("secret-1\r\n")) wide += {c, '\0'};
  EXPECT_EQ(problem(wide), "a/t is UTF-16; save it as UTF-8");
  EXPECT_EQ(problem(wide.substr(2)), "a/t is UTF-16; save it as UTF-8");
  for (const char* text :
       {"", "\xEF\xBB\xBF", "\r\nsecret-1\n", "secret\n", "secret 12\n", "secret-1 \n"}) {
    const std::string found = problem(text);
    EXPECT_NE(found.find(" a/t"), std::string::npos) << found;
    EXPECT_EQ(found.find("UTF-16"), std::string::npos) << found;
  }
}

}  // namespace
}  // namespace swarmtalk::view
