"""MkDocs hook (mkdocs.yml): GitHub wants | escaped in the code of a table, Markdown for Python shows the escape."""


def on_page_content(html, **_):
    return html.replace("\\|", "|")
