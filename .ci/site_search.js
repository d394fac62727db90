// Before the theme's worker of the search, which finds what has any of the words. Here a part of a page needs all of
// them, by their beginnings; where some have them close together, these only; where none has all, any will do.
{
  const CLOSE = 4, BLOCK = 2 ** 20;
  const SPELLING = [[/^neighbor/, "neighbour"], [/^behavior/, "behaviour"], [/^color/, "colour"], [/^center/, "centre"]];
  // Words of a title or text are numbered in each of its blocks, and so are the blocks: BLOCK * block + word.
  const together = (beginnings, { matchData: { metadata } }) => ["title", "text"].some((field) => {
    const places = beginnings.map((beginning) => Object.keys(metadata).filter((term) => term.startsWith(beginning))
      .flatMap((term) => metadata[term][field]?.position ?? []));
    return places[0].some((first) => places.every((some) => some.some((place) => Math.abs(place - first) <= CLOSE)));
  });

  // The theme makes lunr after this script, and asks it once a message has come.
  const replaceSearch = () => {
    const { prototype } = self.lunr.Index, search = prototype.search;
    prototype.search = function searchAll(query) {
      const all = search.call(this, query), beginnings = [...query.matchAll(/\+(\S+)\*/g)].map(([, word]) => word);
      const close = beginnings.length > 1 ? all.filter((hit) => together(beginnings, hit)) : [];
      return [close, all].find((hits) => hits.length) ?? search.call(this, query.replaceAll("+", ""));
    };
  };
  let separator;
  addEventListener("message", ({ data }) => {
    replaceSearch();
    separator = new RegExp(data.data.config.separator);
  }, { once: true });

  // Long words without the s of a plural: they are beginnings.
  const beginning = (word) => SPELLING.reduce((text, [from, to]) => text.replace(from, to), word.toLowerCase())
    .replace(/^(.{3,}[^sui])s$/, "$1");
  // Whole words count more.
  const clause = (word) => `+${word}* ${word}^9`;
  addEventListener("message", ({ data }) => {
    // A query in the language of the search is left as it is.
    if (data.type !== 2 || /["*~^]|(^|\s)[+-]/.test(data.data)) return;
    const words = data.data.split(separator).filter((word) => word && self.lunr.stopWordFilter(word.toLowerCase()));
    data.data = words.map((word) => clause(beginning(word))).join(" ");
  });
}
