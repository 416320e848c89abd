// SPDX-License-Identifier: MIT
// From the text of an Inventor file to its nodes (Wernecke 1994, "The Inventor Mentor", chapter
// 11).
#include "renderer/import/assimp/conversion.h"
#include "renderer/import/assimp/inventor.h"

#include <cctype>
#include <cstring>

namespace vitrail
{

namespace
{

constexpr int DEPTH_MAX = 200; // of nodes in nodes; files of programs have some ten

class inventor_parser
{
  public:
    explicit inventor_parser(std::string_view whole) : text_(whole) {}
    std::shared_ptr<inventor_node> parse();

  private:
    void skip_blank();
    bool is_at_end();
    std::string word();
    std::string peek();
    [[noreturn]] void fail(const std::string &what) const;
    std::shared_ptr<inventor_node> node(const std::string &first, int depth);
    void body(inventor_node &into, int depth);
    void value(std::vector<std::string> &words);

    std::string_view text_;
    size_t at_ = 0;
    int line_ = 1;
    std::map<std::string, std::shared_ptr<inventor_node>> named_;
};

void inventor_parser::fail(const std::string &what) const
{
    refuse("line %d: %.120s", line_, what.c_str());
}

void inventor_parser::skip_blank()
{
    for (; at_ < text_.size(); at_++) {
        char c = text_[at_];
        if (c == '#')
            while (at_ + 1 < text_.size() && text_[at_ + 1] != '\n')
                at_++;
        else if (c == '\n')
            line_++;
        else if (c != ',' && !isspace(static_cast<unsigned char>(c)))
            return;
    }
}

bool inventor_parser::is_at_end()
{
    skip_blank();
    return at_ >= text_.size();
}

// A brace, a bracket, a bar, a text with its first quote, or what stands between blanks.
std::string inventor_parser::word()
{
    if (is_at_end())
        fail("the file ends within a node");
    size_t begin = at_;
    char c = text_[at_++];
    if (strchr("{}[]()|~", c))
        return std::string(1, c);
    if (c == '"') {
        while (at_ < text_.size() && text_[at_] != '"') {
            line_ += text_[at_] == '\n';
            at_ += text_[at_] == '\\' ? 2 : 1;
        }
        if (at_ >= text_.size())
            fail("a text has no end");
        return std::string(text_.substr(begin, at_++ - begin));
    }
    while (at_ < text_.size() && !isspace(static_cast<unsigned char>(text_[at_])) &&
           !strchr("{}[]()|~,\"#", text_[at_]))
        at_++;
    return std::string(text_.substr(begin, at_ - begin));
}

std::string inventor_parser::peek()
{
    if (is_at_end())
        return "";
    size_t at = at_;
    int line = line_;
    std::string next = word();
    at_ = at;
    line_ = line;
    return next;
}

bool is_number(const std::string &word)
{
    return !word.empty() && strchr("0123456789+-.", word[0]);
}

void inventor_parser::value(std::vector<std::string> &words)
{
    std::string first = word();
    if (first == "[" || first == "(") {
        const char *end = first == "[" ? "]" : ")";
        for (std::string next = word(); next != end; next = word()) {
            if (next == "{" || next == "}")
                fail("a list of values has no end");
            words.push_back(next);
        }
        return;
    }
    if (first == "{" || first == "}" || first == "]")
        fail("a value is missing before '" + first + "'");
    words.push_back(first);
    for (std::string next = peek(); is_number(next) || next == "|" || next == "~"; next = peek())
        words.push_back(word());
}

// The inside of a node up to its brace. A word with a brace behind it is a node, any other a field.
void inventor_parser::body(inventor_node &into, int depth)
{
    for (std::string next = word(); next != "}"; next = word()) {
        if (next == "DEF" || next == "USE" || peek() == "{") {
            into.children.push_back(node(next, depth + 1));
            continue;
        }
        if (!isalpha(static_cast<unsigned char>(next[0])) && next[0] != '_')
            fail("'" + next + "' is neither a field nor a node");
        value(into.fields[next]);
    }
}

std::shared_ptr<inventor_node> inventor_parser::node(const std::string &first, int depth)
{
    if (depth > DEPTH_MAX)
        fail(text("more than %d nodes are in each other", DEPTH_MAX));
    if (first == "USE") {
        std::string name = word();
        auto known = named_.find(name);
        if (known == named_.end())
            fail("USE of '" + name + "', which is not defined before");
        return known->second;
    }
    auto made = std::make_shared<inventor_node>();
    made->type = first;
    if (first == "DEF") {
        made->name = word();
        made->type = word();
    }
    if (word() != "{")
        fail("the node '" + made->type + "' has no brace");
    body(*made, depth);
    if (!made->name.empty())
        named_[made->name] = made;
    return made;
}

std::shared_ptr<inventor_node> inventor_parser::parse()
{
    std::string_view head = text_.substr(0, text_.find('\n'));
    bool is_known = head.substr(0, 12) == "#Inventor V2" || head.substr(0, 10) == "#VRML V1.0";
    if (!is_known || head.find("ascii") == head.npos)
        refuse("its head '%.40s' is not '#Inventor V2.0 ascii', '#Inventor V2.1 ascii' or '#VRML "
               "V1.0 ascii'",
               std::string(head.substr(0, 40)).c_str());
    auto root = std::make_shared<inventor_node>();
    root->type = "Separator";
    while (!is_at_end())
        root->children.push_back(node(word(), 0));
    return root;
}

} // namespace

std::shared_ptr<inventor_node> parse_inventor(std::string_view whole)
{
    return inventor_parser(whole).parse();
}

} // namespace vitrail
