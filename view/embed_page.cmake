# Writes page.cpp: the page as bytes of the program. cmake -DPAGE=index.html -DOUT=page.cpp -P this
file(READ ${PAGE} hex HEX)
string(LENGTH "${hex}" digits)
math(EXPR bytes "${digits} / 2")
if(bytes GREATER_EQUAL 60000)
  message(FATAL_ERROR "${PAGE} has ${bytes} bytes; it must stay below 60000, to load at once over a bad link")
endif()
string(REGEX REPLACE "(..)" "0x\\1," list "${hex}")
string(REGEX REPLACE "(................................................................................)" "\\1\n"
  list "${list}")
file(WRITE ${OUT} "#include \"view/page.hpp\"

namespace swarmtalk::view {
namespace {

constexpr unsigned char kPage[] = {
${list}};

}  // namespace

std::string_view page() {
  return {reinterpret_cast<const char*>(kPage), sizeof kPage};
}

}  // namespace swarmtalk::view
")
