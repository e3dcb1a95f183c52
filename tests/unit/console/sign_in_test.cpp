#include "client/console/access/sign_in.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>

#include "tests/support/temporary_folder.h"

namespace hapticd::console {
namespace {

using std::chrono::seconds;

constexpr std::uint16_t kPort = 50080;
constexpr SignIn::User kAnna = 1000U;

class SignInTest : public testing::Test {
 protected:
  SignIn of(const std::string& folder, std::uint16_t port = kPort) {
    return SignIn(folder, seconds(3600), port, [this] { return now_; });
  }
  static mode_t mode(const std::string& path) {
    struct stat file {};
    return stat(path.c_str(), &file) == 0 ? file.st_mode & 0777U : 0U;
  }

  std::chrono::system_clock::time_point now_{seconds(1'000'000)};
  const SignIn sign_in_ = of("");
};

TEST_F(SignInTest, ACookieNamesItsPerson) {
  for (const char* name : {"user:anna", "local", "unix:haptics", "user:anna maria"}) {
    const auto session = sign_in_.session_of(sign_in_.cookie_for(name, kAnna), kAnna);
    ASSERT_NE(session, nullptr) << name;
    EXPECT_EQ(session->name, name);
  }
}

TEST_F(SignInTest, ACookieEnds) {
  const std::string cookie = sign_in_.cookie_for("user:anna", kAnna);
  now_ += seconds(3599);
  EXPECT_NE(sign_in_.session_of(cookie, kAnna), nullptr);
  now_ += seconds(2);
  EXPECT_EQ(sign_in_.session_of(cookie, kAnna), nullptr);
}

TEST_F(SignInTest, AChangedCookieIsNone) {
  const std::string cookie = sign_in_.cookie_for("user:anna", kAnna);
  for (std::size_t i = 0; i < cookie.size(); ++i) {
    std::string changed = cookie;
    changed[i] = changed[i] == '0' ? '1' : '0';
    EXPECT_EQ(sign_in_.session_of(changed, kAnna), nullptr) << i;
  }
  for (const std::string& text : {std::string(), std::string("."), std::string("a.b"), cookie + "0",
                                  cookie.substr(1), std::string(5000, '0')}) {
    EXPECT_EQ(sign_in_.session_of(text, kAnna), nullptr) << text;
  }
  EXPECT_EQ(sign_in_.session_of(sign_in_.cookie_for("", kAnna), kAnna), nullptr) << "it names no one";
}

TEST_F(SignInTest, ACookieIsOfOneUserOfTheMachine) {
  const std::string cookie = sign_in_.cookie_for("user:anna", kAnna);
  EXPECT_EQ(sign_in_.session_of(cookie, 1001U), nullptr);
  EXPECT_EQ(sign_in_.session_of(cookie, std::nullopt), nullptr);
  // In a container the kernel shows none.
  EXPECT_NE(sign_in_.session_of(sign_in_.cookie_for("local", std::nullopt), std::nullopt), nullptr);
}

TEST_F(SignInTest, ACookieIsOfOnePort) {
  const test::TemporaryFolder folder;
  const SignIn here = of(folder.path());
  const SignIn elsewhere = of(folder.path(), kPort + 1);
  const std::string cookie = here.cookie_for("user:anna", kAnna);
  EXPECT_NE(of(folder.path()).session_of(cookie, kAnna), nullptr) << "the secret is the same";
  EXPECT_EQ(elsewhere.session_of(cookie, kAnna), nullptr);
}

TEST_F(SignInTest, WithoutItsSecretACookieIsNone) {
  const test::TemporaryFolder folder;
  const std::string cookie = of(folder.path()).cookie_for("user:anna", kAnna);
  EXPECT_EQ(mode(folder.path("console.key")), 0600U);
  std::filesystem::remove(folder.path("console.key"));
  EXPECT_EQ(of(folder.path()).session_of(cookie, kAnna), nullptr);
}

TEST_F(SignInTest, ASecretThatOthersMayReadIsReplaced) {
  for (const mode_t open_to_others : {0640U, 0604U, 0622U}) {
    const test::TemporaryFolder folder;
    const std::string path = folder.path("console.key");
    const std::string cookie = of(folder.path()).cookie_for("user:anna", kAnna);
    const std::string before = test::file_text(path);
    ASSERT_EQ(chmod(path.c_str(), open_to_others), 0);
    EXPECT_EQ(of(folder.path()).session_of(cookie, kAnna), nullptr);
    EXPECT_NE(test::file_text(path), before);
    EXPECT_EQ(mode(path), 0600U);
  }
}

TEST_F(SignInTest, AFolderThatCannotBeWrittenToKeepsNoOneOut) {
  const SignIn nowhere = of("/nonexistent");
  EXPECT_NE(nowhere.session_of(nowhere.cookie_for("user:anna", kAnna), kAnna), nullptr);
}

}  // namespace
}  // namespace hapticd::console
