// Order of the results of a search: what explains stands before what lists. The rest are the defaults of Sphinx.
var Scorer = {
  score: ([page, , , , score]) => {
    if (/^(source|changes|contributing|security)$/.test(page)) return score - 12;
    return page.startsWith("api/") ? score - 4 : score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
