//! Contents of `#[key(...)]`, `#[keys(...)]` and doc comments.

use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::meta::ParseNestedMeta;
use syn::{
    Attribute, Expr, ExprLit, GenericArgument, Ident, Lit, LitStr, Meta, Path, PathArguments, Token, Type, parse_quote,
};

/// Kind of entry of a field.
#[derive(Default)]
pub enum Form {
    /// A single value.
    #[default]
    Value,
    /// A table of keys.
    Table,
    /// A list of tables.
    Tables,
    /// Keys that stand in the same table.
    Flatten,
    /// No key.
    Skip(Expr),
}

/// The entries of `#[key(...)]`.
#[derive(Default)]
pub struct Attributes {
    pub form: Form,
    pub word: bool,
    /// The type, a tuple struct of the field's, that reads and writes the value; of flattened keys the table of these.
    pub via: Option<Path>,
    /// What flattened keys mean, once all others are read.
    pub then: Option<Expr>,
    /// The table holds tables by names of the user's choice.
    pub named: bool,
    /// The table is read from nothing where the case leaves it out: all its keys have defaults.
    pub from_nothing: bool,
    /// Later tables can look it up in the context.
    pub shared: bool,
    /// The variant stands for a table that is left out.
    pub absent: bool,
    pub name: Option<String>,
    pub unit: Option<String>,
    /// Which of several kinds of quantity with that unit.
    pub quantity: Option<String>,
    pub range: Option<Expr>,
    pub within: Option<Expr>,
    pub count: [Option<Expr>; 2],
    pub default: Option<Expr>,
    pub says: Option<Expr>,
    pub meant: Option<Expr>,
    pub literal: Option<(Ident, Expr, String, Option<String>)>,
    pub example: Option<String>,
    pub omit_if: Option<Expr>,
    /// Form of the value in the copy of the case.
    pub show: Tokens,
}

impl Attributes {
    pub fn of(attributes: &[Attribute]) -> syn::Result<Self> {
        let mut found = Self { show: quote!(crate::write::Show::Table), ..Self::default() };
        for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("key")) {
            attribute.parse_nested_meta(|meta| found.entry(&meta))?;
        }
        Ok(found)
    }

    fn entry(&mut self, meta: &ParseNestedMeta<'_>) -> syn::Result<()> {
        let Some(name) = meta.path.get_ident().map(Ident::to_string) else {
            return Err(meta.error("expected a name"));
        };
        let text = || -> syn::Result<String> { Ok(meta.value()?.parse::<LitStr>()?.value()) };
        let expression = || -> syn::Result<Expr> { meta.value()?.parse() };
        match name.as_str() {
            "word" => self.word = true,
            "table" => self.form = Form::Table,
            "tables" => self.form = Form::Tables,
            "flatten" => self.form = Form::Flatten,
            "from_nothing" => self.from_nothing = true,
            "via" => self.via = Some(meta.value()?.parse()?),
            "then" => self.then = Some(expression()?),
            "named" => self.named = true,
            "shared" => self.shared = true,
            "absent" => self.absent = true,
            "inline" => self.show = quote!(crate::write::Show::Inline),
            "dotted" => self.show = quote!(crate::write::Show::Dotted),
            "skip" => self.form = Form::Skip(expression()?),
            "name" => self.name = Some(text()?),
            "unit" => self.unit = Some(text()?),
            "quantity" => self.quantity = Some(text()?),
            "says" => self.says = Some(expression()?),
            "meant" => self.meant = Some(expression()?),
            "example" => self.example = Some(text()?),
            "range" => self.range = Some(expression()?),
            "within" => self.within = Some(expression()?),
            "least" => self.count[0] = Some(expression()?),
            "most" => self.count[1] = Some(expression()?),
            "default" if !meta.input.peek(Token![=]) => self.default = Some(parse_quote!(Default::default())),
            "default" => self.default = Some(expression()?),
            "omit_if" => self.omit_if = Some(expression()?),
            "paper_literal" => {
                let stream = meta.value()?;
                let inner;
                syn::parenthesized!(inner in stream);
                let paper = inner.parse()?;
                inner.parse::<Token![,]>()?;
                let value = inner.parse()?;
                inner.parse::<Token![,]>()?;
                let reason = inner.parse::<LitStr>()?.value();
                let says = match inner.parse::<Option<Token![,]>>()? {
                    Some(_) if !inner.is_empty() => Some(inner.parse::<LitStr>()?.value()),
                    _ => None,
                };
                self.literal = Some((paper, value, reason, says));
            }
            other => return Err(meta.error(format!("`{other}` is no entry of `#[key(...)]`"))),
        }
        Ok(())
    }
}

/// The function named by `#[keys(check = path)]`.
pub fn check_of(attributes: &[Attribute]) -> syn::Result<Option<Path>> {
    let mut found = None;
    for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("keys")) {
        attribute.parse_nested_meta(|meta| {
            if !meta.path.is_ident("check") {
                return Err(meta.error("expected `check = path`"));
            }
            found = Some(meta.value()?.parse()?);
            Ok(())
        })?;
    }
    Ok(found)
}

/// The doc comment, its lines joined.
pub fn about(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    lines.collect::<Vec<_>>().join(" ")
}

/// Type inside `Wrapper<...>`.
pub fn inner_of<'t>(kind: &'t Type, wrapper: &str) -> Option<&'t Type> {
    let Type::Path(path) = kind else { return None };
    let last = path.path.segments.last().filter(|segment| segment.ident == wrapper)?;
    let PathArguments::AngleBracketed(arguments) = &last.arguments else { return None };
    arguments.args.iter().find_map(|argument| match argument {
        GenericArgument::Type(inner) => Some(inner),
        _ => None,
    })
}

/// `HalfSpace` as `half_space`.
pub fn snake(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.extend(c.to_lowercase());
    }
    text
}
