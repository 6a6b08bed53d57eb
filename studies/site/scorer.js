// Order of what the search finds: pages that explain before lists, records of changes and code.
var Scorer = {
  score: ([page, , , , score]) => score + (/CHANGES|made\/(code|python)|studies\/report\/|tests\/README/.test(page) ? -8 :
    /site\/questions/.test(page) ? 8 : /scene\/(guide|GUIDE|GLOSSARY)|site\/(start|tasks)|notebooks|made\/effects/.test(page) ? 4 : 0),
  objNameMatch: 11, objPartialMatch: 6, objPrio: {0: 15, 1: 5, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
