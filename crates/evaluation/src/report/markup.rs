//! Elements of the page and its figures, well formed by construction.
//!
//! Nothing here is specific to one element: a tree of names, attributes and text, which escapes all it is given and
//! closes all it opens, so that the page is XML and HTML at once.

use std::fmt;

use super::number::coordinate;

/// HTML elements and SVG shapes that never hold anything; all others get a closing tag, for HTML wants one.
const EMPTY: [&str; 8] = ["meta", "br", "hr", "line", "rect", "path", "circle", "polygon"];

/// Elements amid text, where a line break in the source would become a space on the page.
const INLINE: [&str; 10] = ["var", "sub", "span", "strong", "em", "code", "tspan", "td", "th", "br"];

/// One element and all inside it.
#[derive(Clone, Debug)]
pub(super) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Node>,
}

#[derive(Clone, Debug)]
enum Node {
    Element(Element),
    Text(String),
    /// Style sheets of this crate: `>` and quotes must reach the browser as they are.
    Verbatim(&'static str),
}

impl Element {
    pub(super) fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), children: Vec::new() }
    }

    /// An element with a class, the most frequent kind.
    pub(super) fn classed(name: &'static str, class: &str) -> Self {
        Self::new(name).with("class", class)
    }

    /// Adds an attribute.
    pub(super) fn with(mut self, attribute: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((attribute, value.into()));
        self
    }

    /// Adds attributes that hold one number each, as those of shapes do.
    pub(super) fn at<const N: usize>(mut self, numbers: [(&'static str, f64); N]) -> Self {
        self.attributes.extend(numbers.map(|(attribute, value)| (attribute, coordinate(value))));
        self
    }

    /// Adds text.
    pub(super) fn text(mut self, text: impl Into<String>) -> Self {
        self.children.push(Node::Text(text.into()));
        self
    }

    /// Adds an element.
    pub(super) fn child(mut self, child: Self) -> Self {
        self.children.push(Node::Element(child));
        self
    }

    /// Adds elements, one after the other.
    pub(super) fn children(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children.into_iter().map(Node::Element));
        self
    }

    /// Adds a style sheet as it is; it must hold neither `<` nor `&`.
    pub(super) fn verbatim(mut self, text: &'static str) -> Self {
        debug_assert!(!text.contains(['<', '&']));
        self.children.push(Node::Verbatim(text));
        self
    }
}

impl fmt::Display for Element {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line_end = if INLINE.contains(&self.name) { "" } else { "\n" };
        write!(formatter, "<{}", self.name)?;
        for (attribute, value) in &self.attributes {
            write!(formatter, " {attribute}=\"{}\"", escape(value))?;
        }
        if EMPTY.contains(&self.name) {
            return write!(formatter, "/>{line_end}");
        }
        write!(formatter, ">")?;
        for child in &self.children {
            match child {
                Node::Element(element) => write!(formatter, "{element}")?,
                Node::Text(text) => write!(formatter, "{}", escape(text))?,
                Node::Verbatim(text) => write!(formatter, "{text}")?,
            }
        }
        write!(formatter, "</{}>{line_end}", self.name)
    }
}

/// Makes any text safe between tags and inside quotes; what XML cannot hold at all becomes U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' => escaped.push(character),
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            _ if character.is_control() => escaped.push('\u{fffd}'),
            _ => escaped.push(character),
        }
    }
    escaped
}

/// The start of a text, with an ellipsis where it was cut: figures have no room for long names.
pub(super) fn shortened(text: &str, longest: usize) -> String {
    if text.chars().count() <= longest {
        return text.to_owned();
    }
    let start: String = text.chars().take(longest.saturating_sub(1)).collect();
    start + "…"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_attributes_are_escaped() {
        let element =
            Element::new("p").with("title", "a\"b'<&").text("<script>&amp;\u{0}\u{1b}\u{ffff}</script>");
        assert_eq!(
            element.to_string(),
            "<p title=\"a&quot;b&#39;&lt;&amp;\">&lt;script&gt;&amp;amp;\u{fffd}\u{fffd}\u{fffd}&lt;/script&gt;</p>\n"
        );
    }

    #[test]
    fn shapes_close_themselves_and_containers_do_not() {
        let shape = Element::new("line").at([("x1", 1.0), ("x2", f64::NAN)]);
        assert_eq!(shape.to_string(), "<line x1=\"1\" x2=\"0\"/>\n");
        assert_eq!(Element::new("td").to_string(), "<td></td>");
    }

    #[test]
    fn long_names_are_cut_between_characters() {
        assert_eq!(shortened("häuschen", 8), "häuschen");
        assert_eq!(shortened("häuschen", 3), "hä…");
    }
}
